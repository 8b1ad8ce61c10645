"""Which discretisation scheme predicts how well, at what cost, on systems that are stiff."""

from rumo.studies.discretization.cases import CASES, Case
from rumo.studies.discretization.study import DiscretizationStudy

__all__ = ["CASES", "Case", "DiscretizationStudy"]
