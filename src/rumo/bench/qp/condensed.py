"""Dense quadratic programs in the inputs alone: what a solver that condenses has to solve."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import splu

from rumo.controllers.engines.conditions import SparseProgram
from rumo.signals import Array


@dataclass(frozen=True, eq=False)
class QuadraticProgram:
    """Minimise `v' H v / 2 + g' v + sum(l1 s + l2 s^2)` subject to bounds and two-sided rows.

    A row is hard where its `l1` is infinite; a soft row may exceed its upper limit by s >= 0.

    Attributes
    ----------
    hessian, gradient : ndarray, shapes (n, n), (n,)
    lower, upper : ndarray, shape (n,)
    rows : ndarray, shape (m, n)
    row_lower, row_upper, l1, l2 : ndarray, shape (m,)
    """

    hessian: Array
    gradient: Array
    lower: Array
    upper: Array
    rows: Array
    row_lower: Array
    row_upper: Array
    l1: Array
    l2: Array


def condense(program: SparseProgram) -> QuadraticProgram:
    """Express the variables that follow from the inputs by these: `q = Z v + known`. Source: Frison (2015), ch. 6."""
    n = len(program.lower)
    factor = splu(program.equations[:, n:])
    Z = np.vstack([np.eye(n), -factor.solve(program.equations[:, :n].toarray())])
    known = np.r_[np.zeros(n), factor.solve(program.ends)]
    at_known = program.rows @ known
    return QuadraticProgram(
        hessian=Z.T @ (program.hessian @ Z),
        gradient=Z.T @ (program.gradient + program.hessian @ known),
        lower=program.lower,
        upper=program.upper,
        rows=program.rows @ Z,
        row_lower=program.row_lower - at_known,
        row_upper=program.row_upper - at_known,
        l1=program.l1,
        l2=program.l2,
    )
