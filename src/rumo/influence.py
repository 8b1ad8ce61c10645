"""Which constraints free inputs can influence, by the sparsity of the stages alone."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np

from rumo.graphs import reachable


def influenced(terms: Mapping[str, Any], horizon: int, delay: int, substeps: int) -> np.ndarray:
    """Whether some free input can influence a constraint at a stage.

    Parameters
    ----------
    terms : mapping of str to casadi expression
        The matrices A0, M, B, D, E of a substep by the names of `Stages`.
    horizon, delay, substeps : int
        Intervals, those whose inputs are decided, and substeps of each.

    Returns
    -------
    ndarray of bool, shape (N, nc)
    """
    A0, M, B, D, E = (_rows_by_column(terms[name]) for name in ("A0", "M", "B", "D", "E"))
    imposed = np.zeros((horizon, terms["D"].size1()), dtype=bool)
    variables: set[int] = set()
    for k in range(delay, horizon):
        before = variables
        for _ in range(substeps):
            equations = set().union(*B, *(A0[i] for i in variables if i < len(A0)))
            # M^-1 spreads it to all that is reached through M: with M = I - A1, it is I + A1 + A1^2 + ...
            last, variables = variables, reachable(M, equations)
            if last == variables:
                break
        imposed[k:, sorted(set().union(*E, *(D[i] for i in variables if i < len(D))))] = True
        if before == variables:  # it only grows
            break
    return imposed


def _rows_by_column(matrix: Any) -> list[list[int]]:
    """Rows of the structural nonzeros of each column."""
    sparsity = matrix.sparsity()
    rows = sparsity.row()
    return [rows[start:end] for start, end in pairwise(sparsity.colind())]
