"""The order in which the unknowns of a block are eliminated, found from numbers."""

from __future__ import annotations

import numpy as np

from rumo.signals import Array

SWEEPS = 4
STEADY = 0.25
"""A pivot should be at least this share of the largest entry of its column."""
HUGE = 1e100
STIFF = 0.1
"""Unknowns are eliminated before those whose pivots are smaller by more than this factor."""


def pivot_order(pattern: np.ndarray, samples: Array) -> tuple[list[int], list[int]]:
    """Rows and columns of a matrix in the order in which they become pivots.

    Of the pivots that can be relied on, on the diagonal if possible, those of stiff unknowns come first: they are
    large, and stay so wherever a controller gets. Of these, the one that fills in least.

    Parameters
    ----------
    pattern : ndarray of bool, shape (n, n)
        Structural nonzeros.
    samples : ndarray, shape (points, n, n)
        The matrix at some points, of which the median counts; all nonzeros are taken for 1 where there are none.

    Notes
    -----
    Source: Markowitz (1957), with the threshold of Duff, Erisman and Reid, Direct Methods for Sparse Matrices (1986).
    """
    nonzero, n = pattern.copy(), len(pattern)
    work = balanced(np.where(pattern, samples, 0.0)) if len(samples) else nonzero[None].astype(float)
    size, steady = np.zeros((n, n)), np.zeros((n, n))
    changed = np.arange(n)
    rows: list[int] = []
    columns: list[int] = []
    while nonzero.any():
        sizes = np.abs(work[:, :, changed])
        largest = sizes.max(axis=1, keepdims=True)
        size[:, changed] = np.median(sizes, axis=0)
        steady[:, changed] = np.median(sizes / np.where(largest > 0.0, largest, 1.0), axis=0)
        allowed = nonzero & np.eye(n, dtype=bool) & (steady >= STEADY)
        if not allowed.any():
            allowed = nonzero & (steady >= min(STEADY, steady[nonzero].max()))
        allowed &= size >= STIFF * size[allowed].max()
        fill = np.outer(nonzero.sum(axis=1) - 1, nonzero.sum(axis=0) - 1)
        allowed &= fill == fill[allowed].min()
        i, j = divmod(int(np.argmax(np.where(allowed, size, -1.0))), n)
        rows.append(i)
        columns.append(j)
        below, changed = np.flatnonzero(nonzero[:, j]), np.flatnonzero(nonzero[i])
        left, pivot = (below[:, None], changed), work[:, i, j][:, None, None]
        with np.errstate(over="ignore", invalid="ignore"):
            product = work[:, below, j][:, :, None] * work[:, i, changed][:, None]
            rest = work[:, *left] - product / np.where(pivot == 0.0, 1.0, pivot)
        work[:, *left] = np.nan_to_num(rest, posinf=HUGE, neginf=-HUGE)
        nonzero[left] = True
        work[:, i], nonzero[i], nonzero[:, j] = 0.0, False, False
    # Where the pattern has no pivots left, no order solves it.
    return rows + sorted(set(range(n)) - set(rows)), columns + sorted(set(range(n)) - set(columns))


def balanced(matrices: Array) -> Array:
    """Square matrices (points, n, n) in units that make off-diagonal rows and columns alike. Source: Osborne (1960)."""
    size = np.abs(matrices) * ~np.eye(matrices.shape[1], dtype=bool)
    unit = np.ones(matrices.shape[:2])
    for _ in range(SWEEPS):
        for r in range(matrices.shape[1]):
            with np.errstate(over="ignore"):  # a ratio beyond all numbers is cut like other huge ones
                in_row = (size[:, r] / unit).max(axis=1) * unit[:, r]
                in_column = (size[:, :, r] * unit).max(axis=1) / unit[:, r]
                both = (in_row > 0.0) & (in_column > 0.0) & np.isfinite(in_row) & np.isfinite(in_column)
                fitting = unit[both, r] * np.sqrt(in_column[both] / in_row[both])
            unit[both, r] = np.clip(fitting, 1.0 / HUGE, HUGE)
    return matrices * unit[:, :, None] / unit[:, None, :]
