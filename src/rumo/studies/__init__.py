"""Studies: plain functions from settings to a result."""

from rumo.studies.paper import PaperStudy

__all__ = ["PaperStudy"]
