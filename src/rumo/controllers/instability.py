"""A warning, where a controller is made, that its predictions take an unstable mode for one that decays."""

from __future__ import annotations

import warnings
from inspect import currentframe
from itertools import islice

import casadi as ca
import numpy as np

from rumo.discretization.growth import MisjudgedMode, misjudged_mode
from rumo.discretization.stability import jacobians
from rumo.errors import UnstableModeWarning
from rumo.nominal import POINTS, random_places
from rumo.signals import Array
from rumo.transcription import Transcription

LARGEST = 100
"""States and algebraic variables of a model that takes no time to look at."""
AT_REST = 1e-9
"""Rates of an equilibrium, in the states' units a second."""
NEWTON_STEPS = 20
CONSISTENT = 1e-6


def warn_of_misjudged_mode(transcription: Transcription) -> None:
    """Warn of an unstable mode that the scheme takes for one that decays.

    No state is known yet. The origin, with the safe input, is an equilibrium of many models: what is there counts. Else
    a mode counts if there is one at the origin and at random states too, as in a linear model.
    """
    model, problem = transcription.problem.model, transcription.problem
    if len(model.states) + len(model.algebraic) > LARGEST:
        return
    origin = np.zeros(len(model.states))
    mode = _mode_at(transcription, origin, problem.safe_input)
    if mode is None:
        return
    if not _is_equilibrium(transcription, origin, problem.safe_input):
        others = islice(random_places(len(origin), len(problem.safe_input)), POINTS)
        if any(_mode_at(transcription, x, problem.safe_input) is None for x, _ in others):
            return
    message = f"{model.name}: {mode.described(transcription.discretization)}"
    warnings.warn(message, UnstableModeWarning, stacklevel=_frames_of_ours())


def _frames_of_ours() -> int:
    """How many frames up the one is that called this package, counted from the caller's."""
    level, frame = 0, currentframe()
    while frame is not None and str(frame.f_globals.get("__name__")).partition(".")[0] == "rumo":
        level, frame = level + 1, frame.f_back
    return level


def _mode_at(transcription: Transcription, x: Array, u: Array) -> MisjudgedMode | None:
    """The mode that is misjudged most at a state and input, with the parameters and lengths of each interval."""
    problem, model = transcription.problem, transcription.problem.model
    given = np.column_stack([problem.steps, problem.parameters])
    kinds, first = np.unique(given, axis=0, return_index=True)
    known = [(x, _algebraic(transcription, x, u, p)) for p in kinds[:, 1:]]
    xz = np.array([np.r_[x, np.full(len(model.algebraic), np.nan) if z is None else z] for x, z in known])
    rates = jacobians(model, xz, np.tile(u, (len(kinds), 1)), kinds[:, 1:])
    horizon = float(problem.steps.sum())
    scheme, inputs = transcription.discretization, len(model.inputs)
    return misjudged_mode(scheme, rates, kinds[:, 0], model.states.names, first, horizon, inputs)


def _algebraic(transcription: Transcription, x: Array, u: Array, p: Array) -> Array | None:
    """Algebraic variables (nz,) at a state, by Newton's method; None if it does not converge."""
    model, nz = transcription.problem.model, len(transcription.problem.model.algebraic)
    z = transcription.inner_between(x[None], x[None])[0][:nz]
    if not nz:
        return z
    arguments = [model.xz, model.u, model.p]
    g = model.g(*arguments)
    newton = ca.Function("newton", arguments, [g, ca.jacobian(g, model.z)])
    for _ in range(NEWTON_STEPS):
        residual, matrix = (value.full() for value in newton(np.r_[x, z], u, p))
        if not (np.isfinite(residual).all() and np.isfinite(matrix).all()):
            return None
        try:
            step = np.linalg.solve(matrix, residual[:, 0])
        except np.linalg.LinAlgError:
            return None
        z = z - step
        if (np.abs(step) <= CONSISTENT * (1.0 + np.abs(z))).all():
            return z
    return None


def _is_equilibrium(transcription: Transcription, x: Array, u: Array) -> bool:
    """Whether a state stays where it is."""
    model, p = transcription.problem.model, transcription.problem.parameters[0]
    z = _algebraic(transcription, x, u, p)
    if z is None:
        return False
    rates = model.f(np.r_[x, z], u, p)
    return bool((np.abs(np.array(rates, dtype=float)) <= AT_REST).all())
