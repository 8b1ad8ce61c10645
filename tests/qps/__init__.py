"""Quadratic programs: the C core's solver and others, what proves their answers, and where programs come from."""

from qps.core import CoreQp, Solution, solve
from qps.proofs import Residuals, assert_solved, least_violation, residuals

__all__ = ["CoreQp", "Residuals", "Solution", "assert_solved", "least_violation", "residuals", "solve"]
