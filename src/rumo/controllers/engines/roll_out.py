"""Where a guess's inputs lead, as core/src/stages/roll_out.c."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rumo.controllers.engines.stagewise import eliminate
from rumo.controllers.engines.trajectory import Trajectory
from rumo.signals import Array
from rumo.transcription import Stages, Transcription

SWEEPS = 20
ROLLED_OUT = 1e-9
"""Newton's corrections that are none, over the largest size of a state."""


def linearised(transcription: Transcription, guess: Trajectory) -> tuple[Stages, Array, Array] | None:
    """The stages at a guess, and A and c of what their unknowns do; None where the model has no value."""
    stages = transcription.linearize(guess.x, guess.u, guess.inner, transcription.problem.parameters)
    try:
        A, _, c = eliminate(stages)
    except np.linalg.LinAlgError:
        return None
    return (stages, A, c) if stages.finite and np.isfinite(c).all() else None


def roll_out(transcription: Transcription, guess: Trajectory) -> tuple[Trajectory, Stages, Array] | None:
    """Solve the dynamics from the guess's first state, for all intervals at once; None if Newton's method fails.

    With the stages there, and c, what is left of Newton's corrections.
    """
    nx = guess.x.shape[1]
    for _ in range(SWEEPS):
        seen = linearised(transcription, guess)
        if seen is None:
            return None
        stages, A, c = seen
        if (np.abs(c[:, :nx]).max(axis=0) <= ROLLED_OUT * np.maximum(np.abs(guess.x).max(axis=0), 1.0)).all():
            return guess, stages, c
        dw, before = np.empty_like(c), np.zeros(nx)
        for k in range(len(c)):
            dw[k] = A[k] @ before + c[k]
            before = dw[k, :nx]
        x = np.vstack([guess.x[:1], guess.x[1:] + dw[:, :nx]])
        guess = replace(guess, x=x, inner=guess.inner + dw[:, nx:])
    return None
