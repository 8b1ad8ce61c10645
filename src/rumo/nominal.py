"""Numbers of a substep's equations at places where a model may be."""

from __future__ import annotations

from collections.abc import Iterator

import casadi as ca
import numpy as np

from rumo.signals import Array
from rumo.transcription import Transcription

POINTS, TRIALS = 5, 40
SMALL, LARGE = 1e-2, 1e2
"""Of states."""
NEWTON_STEPS = 3
"""From a random state towards the end of a substep: fast motions decay as they do in operation."""


def random_places(nx: int, nu: int) -> Iterator[tuple[Array, Array]]:
    """States (nx,) and inputs (nu,) where a model may be, `TRIALS` of them, the same each time."""
    rng = np.random.default_rng(0)
    for trial in range(TRIALS):
        x, u = np.exp(rng.uniform(np.log(SMALL), np.log(LARGE), nx)), np.zeros(nu)
        if trial % 2:  # many states are never negative, many inputs small
            x, u = x * rng.choice([-1.0, 1.0], nx), rng.uniform(-1.0, 1.0, nu)
        yield x, u


def newton_matrices(transcription: Transcription) -> Array:
    """M (points, nw, nw) of a substep at `POINTS` random states, or fewer where the model gives no numbers.

    Nothing enters that may change from one problem to another with the same equations, so that these share a build.
    """
    problem = transcription.problem
    arguments, terms = transcription.arguments, transcription.terms
    newton = ca.Function("newton", arguments, [terms["defect"], terms["M"]])
    nx, nu, others, unknowns = newton.size1_in(1), newton.size1_in(2), newton.size1_in(4), newton.size1_out(0)
    given = transcription.given(np.tile(problem.model.default_parameters, (problem.horizon, 1)))[0]
    found: list[Array] = []
    for x, u in random_places(nx, nu):
        w, matrix = np.r_[x, transcription.inner_between(x, x)[:others]], np.zeros((unknowns, unknowns))
        try:
            for _ in range(NEWTON_STEPS):
                defect, matrix = (value.full() for value in newton(w[:nx], x, u, given, w[nx:]))
                w = w + np.linalg.solve(matrix, defect[:, 0])
        except np.linalg.LinAlgError:
            continue
        if np.isfinite(matrix).all() and np.isfinite(w).all():
            found.append(matrix)
        if len(found) == POINTS:
            break
    return np.array(found).reshape(len(found), unknowns, unknowns)
