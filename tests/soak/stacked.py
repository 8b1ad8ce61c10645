"""Linear algebra for stacks of matrices, of which some may be singular."""

from __future__ import annotations

import contextlib

import numpy as np


def inverse(matrices):
    return solve(matrices, np.broadcast_to(np.eye(matrices.shape[-1]), matrices.shape))


def turned(apart, turn, tolerance):
    """Whether differences are none, or full turns."""
    turns = np.where(turn > 0.0, apart / np.where(turn > 0.0, turn, 1.0), 0.5)
    return (apart == 0.0) | (np.abs(turns - np.round(turns)) < tolerance)


def times(matrices, vectors):
    return (matrices @ vectors[..., None])[..., 0]


def _one_by_one(function, *stacks):
    """What cannot be done for some becomes NaN for these alone."""
    shape = np.broadcast_shapes(*(stack.shape[:-2] for stack in stacks))
    stacks = [np.broadcast_to(stack, (*shape, *stack.shape[-2:])) for stack in stacks]
    made = np.full(stacks[-1].shape, np.nan)
    for i in np.ndindex(*shape):
        with contextlib.suppress(np.linalg.LinAlgError):
            made[i] = function(*(stack[i] for stack in stacks))
    return made


def solve(matrices, right):
    try:
        return np.linalg.solve(matrices, right)
    except np.linalg.LinAlgError:
        return _one_by_one(np.linalg.solve, matrices, right)


def solve_closely(matrices, right):
    """With residuals in extended precision: small unknowns keep their digits next to large ones."""
    found = solve(matrices, right)
    for _ in range(2):
        left = right - np.asarray(matrices, np.longdouble) @ np.asarray(found, np.longdouble)
        found = found + solve(matrices, left.astype(float))
    return found


def cholesky(matrices):
    try:
        return np.linalg.cholesky(matrices)
    except np.linalg.LinAlgError:
        return _one_by_one(np.linalg.cholesky, matrices)


def least_squares(F, right):
    """Of each F (n, m), with unit columns, by normal equations and one refinement; anything where they depend."""
    normal = F.transpose(0, 2, 1) @ F + 1e-13 * np.eye(F.shape[2])
    forces = np.zeros((len(F), F.shape[2]))
    for _ in range(3):
        off = right - times(F, forces)
        forces = forces + solve(normal, (F.transpose(0, 2, 1) @ off[:, :, None]))[:, :, 0]
    return forces
