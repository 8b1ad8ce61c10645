"""Studies: plain functions from settings to a result."""

from rumo.studies.drive import Drive
from rumo.studies.paper import PaperStudy, kalman_filter

__all__ = ["Drive", "PaperStudy", "kalman_filter"]
