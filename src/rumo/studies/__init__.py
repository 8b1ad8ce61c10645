"""Studies: plain functions from settings to a result."""

from rumo.studies.paper import PaperStudy, kalman_filter

__all__ = ["PaperStudy", "kalman_filter"]
