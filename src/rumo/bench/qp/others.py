"""Other solvers for the same programs, through the package qpsolvers, where it is installed."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Any

import numpy as np

from rumo.bench.qp.condensed import QuadraticProgram

OTHERS = ("daqp", "piqp", "quadprog", "clarabel", "proxqp")
"""Solvers for dense programs."""


def installed() -> list[str]:
    """Names of the solvers that work here: the core's, and those that qpsolvers finds."""
    if find_spec("qpsolvers") is None:
        return ["core"]
    import qpsolvers

    return ["core", *(name for name in OTHERS if name in qpsolvers.available_solvers)]


def posed(program: QuadraticProgram) -> Any:
    """A program as qpsolvers takes it: slack variables, after the others, for soft rows; upper limits before lower."""
    import qpsolvers

    n, m = len(program.gradient), len(program.rows)
    soft = np.flatnonzero(np.isfinite(program.l1))
    s = len(soft)
    H = np.zeros((n + s, n + s))
    H[:n, :n] = program.hessian
    H[range(n, n + s), range(n, n + s)] = 2.0 * program.l2[soft]
    relief = np.zeros((m, s))
    relief[soft, range(s)] = -1.0
    G = np.vstack([np.hstack([program.rows, relief]), np.hstack([-program.rows, np.zeros((m, s))])])
    h = np.r_[program.row_upper, -program.row_lower]
    kept = np.isfinite(h)
    return qpsolvers.Problem(
        H,
        np.r_[program.gradient, program.l1[soft]],
        G[kept] if kept.any() else None,
        h[kept] if kept.any() else None,
        None,
        None,
        np.r_[program.lower, np.zeros(s)],
        np.r_[program.upper, np.full(s, np.inf)],
    )
