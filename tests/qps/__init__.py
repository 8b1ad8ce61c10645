"""Quadratic programs: the C core's solver and others, what proves their answers, and where programs come from."""

from qps.proofs import Residuals, assert_answered, assert_solved, least_violation, residuals
from rumo.bench.qp import CoreQp, Solution


def solve(program, **settings):
    """Solve from an empty working set."""
    return CoreQp(len(program.gradient), len(program.rows)).solve(program, **settings)


__all__ = [
    "CoreQp",
    "Residuals",
    "Solution",
    "assert_answered",
    "assert_solved",
    "least_violation",
    "residuals",
    "solve",
]
