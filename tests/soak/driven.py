"""Random drives: measurements and their faults, references, budgets, changes; and all that came of them, as arrays."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

import rumo
from rumo.status import STATUSES
from soak.drawn import Drawn, chance, log_uniform

CHANGES = 250
"""Of the working set in one program, at most. One solved step in 800 has as many in all its programs together; without,
programs that never come to an end take half of the time."""
WILD = np.array([np.nan, np.inf, -np.inf, 1e308, -1e308, 1e300, 1e20, -1e6, 1e-300, 0.0])


@dataclass
class Layout:
    """Where the parts of a step's record lie: see `show` in core/tests/watched.c."""

    shapes: dict[str, tuple[int, ...]]
    size: int = 0
    parts: dict[str, slice] = field(default_factory=dict)

    def __post_init__(self):
        for name, shape in self.shapes.items():
            self.parts[name] = slice(self.size, self.size + int(np.prod(shape)))
            self.size = self.parts[name].stop

    def of(self, records, name):
        """A part (steps, ...) of records (steps, size)."""
        return records[:, self.parts[name]].reshape(len(records), *self.shapes[name])


def layouts(transcription) -> tuple[Layout, Layout]:
    """Of a solution as watched, and of a plan."""
    problem, N = transcription.problem, transcription.problem.horizon
    nx, nu, nz = (len(part) for part in (problem.model.states, problem.model.inputs, problem.model.algebraic))
    solution = {
        "u": (N, nu),
        "x": (N + 1, nx),
        "inner": (transcription.unknowns - nx, N),
        "du": (N, nu),
        "dx": (N + 1, nx),
        "measured": (nx,),
        "decided": (max(problem.delay, 1), nu),
        "reference": (N + 1, len(problem.outputs)),
    }
    plan = {
        "u": (N, nu),
        "x": (N + 1, nx),
        "constraints": (N, len(problem.constraints)),
        "z": (N, nz),
        "diagnostics": (5,),
    }
    return Layout(solution), Layout(plan)


@dataclass
class Drive:
    """What a controller was told at each step, what it made of it, and the numbers of its problem then.

    Attributes
    ----------
    measured, wanted, decided : ndarray, shapes (n, nx), (n, N + 1, ny), (n, max(d, 1), nu)
        What it was told.
    plans, solutions : ndarray, shapes (n, size), (n, 2, size)
        What came of it, and where it was linearised.
    status, cause, solved : ndarray of int, shape (n,)
        And how often the solver was called.
    health : ndarray, shape (n, nx, 3)
        Of readings: deviations, samples, and a symptom, see `rumo_symptom`.
    trusted_step : ndarray, shape (n,)
    sizes : ndarray, shape (nx,)
        Of states, as usual.
    """

    transcription: Any
    measured: np.ndarray
    wanted: np.ndarray
    decided: np.ndarray
    plans: np.ndarray
    solutions: np.ndarray
    status: np.ndarray
    cause: np.ndarray
    solved: np.ndarray
    health: np.ndarray
    trusted_step: np.ndarray
    sizes: np.ndarray

    @property
    def problem(self) -> rumo.Problem:
        return self.transcription.problem


def some_settings(rng, hurried=False) -> dict[str, Any]:
    """Few iterations, no patience, or as usual; and hardly any time, which no seed can repeat."""
    return {
        "sqp_iterations": 1 + int(chance(rng, 0.2) * rng.integers(4)),
        "settling_iterations": int(rng.integers(12)) if chance(rng, 0.9) else 100,
        "trusted_step": float(rng.choice([np.inf, 0.1, 0.1, rng.uniform(0.0, 0.3), 0.0])),
        "preparation_iterations": int(chance(rng, 0.1) * rng.integers(1, 3)),
        "gate": rng.choice(
            [None, rumo.InnovationGate(), rumo.InnovationGate(rng.uniform(0.01, 9.0), int(rng.integers(8)))]
        ),
        "qp": rumo.QpOptions(
            max_iterations=int(rng.integers(8)) if chance(rng, 0.1) else CHANGES,
            time_limit=float(log_uniform(rng, -8.0, -3.0)) if hurried and chance(rng, 0.5) else np.inf,
        ),
    }


def some_changes(rng, problem) -> dict[str, Any]:
    """Other numbers of a problem."""
    factor = float(log_uniform(rng, -0.5, 0.5))
    names = [constraint.name for constraint in problem.constraints if constraint.name in ("c0", "c1")]
    weights = {name: problem.numbers.tracking[:, i] * factor for i, name in enumerate(problem.outputs)}
    soft = {name: rumo.Penalty(float(log_uniform(rng, -2.0, 3.0))) for name in names}
    return {
        "weights": weights if chance(rng, 0.5) else {},
        "parameters": {"a": rng.uniform(0.5, 1.5)} if chance(rng, 0.7) else {},
        "limits": {name: rng.uniform(0.0, 3.0) for name in names} if chance(rng, 0.5) else {},
        "penalties": soft if chance(rng, 0.3) else {},
    }


def spoil(rng, x, sizes):
    """Noise, and sometimes a fault: a jump, no number, or nonsense."""
    n = len(sizes)
    x *= 1.0 + 1e-3 * rng.uniform(-1.0, 1.0, n)
    x += 1e-3 * sizes * rng.normal(size=n)
    fault = rng.uniform()
    if fault < 0.04:
        x[rng.integers(n)] += rng.choice([-1.0, 1.0]) * log_uniform(rng, -3.0, 3.0)
    elif fault < 0.07:
        x[rng.integers(n)] = rng.choice(WILD)
    elif fault < 0.08:
        x[:] = rng.choice([-1.0, 1.0], n) * log_uniform(rng, -9.0, 9.0, n)
    elif fault < 0.12:
        x[:] = sizes * rng.normal(size=n)


def drive(rng, drawn: Drawn, watch, controller, steps: int, hurried: bool = False) -> Drive:
    """So many steps with one set of numbers, from wherever the controller is."""
    transcription, sizes = controller.transcription, drawn.sizes
    problem = transcription.problem
    of_solution, of_plan = layouts(transcription)
    N, ny, nx, nu = problem.horizon, len(problem.outputs), len(sizes), len(problem.model.inputs)
    made = Drive(
        transcription,
        np.empty((steps, nx)),
        np.empty((steps, N + 1, ny)),
        np.empty((steps, max(problem.delay, 1), nu)),
        np.empty((steps, of_plan.size)),
        np.zeros((steps, 2, of_solution.size)),
        *(np.zeros(steps, dtype=int) for _ in range(3)),
        np.zeros((steps, nx, 3)),
        np.full(steps, controller.settings.trusted_step),
        sizes,
    )
    ranges = problem.numbers.ranges
    wanted = np.tile(ranges * rng.normal(size=ny), (N + 1, 1))
    x = sizes * rng.normal(size=nx)
    states = of_plan.parts["x"]
    drift = 0.02 * ranges * rng.normal(size=(steps, ny))
    dice = rng.uniform(size=(steps, 6))
    for i in range(steps):
        jump, gap, applied, again, twice, configured = dice[i]
        spoil(rng, x, sizes)
        wanted = wanted + drift[i]
        if jump < 0.03:
            wanted = wanted + ranges * rng.normal(size=(N + 1, ny)) * log_uniform(rng, -2.0, 1.0)
        made.wanted[i] = wanted
        if gap < 0.03:
            made.wanted[i, rng.integers(N + 1), rng.integers(ny)] = rng.choice(WILD)
        if applied < 0.02:
            reach = 2.0 * problem.input_scales * rng.uniform(-1.0, 1.0, made.decided[i].shape)
            controller.applied = reach * (1.0 if applied < 0.005 else 0.1)
        if again < 0.01:
            controller.engage(applied=controller.applied, x=np.nan_to_num(x) if again < 0.005 else None)
        if configured < 0.02:
            controller.configure(**some_settings(rng, hurried))
            if configured < 0.005:
                controller.configure(qp=rumo.QpOptions(max_iterations=CHANGES), settling_iterations=20)
        made.trusted_step[i] = controller.settings.trusted_step
        made.measured[i], made.decided[i] = x, controller.applied
        watch.on(made.solutions[i])
        if twice < 0.5:
            plan = controller.step(made.measured[i], made.wanted[i])
        else:
            controller.prepare()
            plan = controller.feedback(made.measured[i], made.wanted[i])
        made.solved[i] = watch.solutions()
        made.plans[i] = plan._numbers
        outcome = plan._outcome
        made.status[i], made.cause[i] = outcome[1], outcome[2]
        if outcome[8]:
            made.health[i].flat[:] = outcome[8]
        following = made.plans[i, states][nx : 2 * nx]
        x = following.copy() if np.abs(following).max() < 1e6 * sizes.max() else sizes * rng.normal(size=nx)
    watch.on(None)
    return made


def counts(status) -> dict[str, int]:
    """Steps by status."""
    return {
        member.name: int(n) for member, n in zip(STATUSES, np.bincount(status, minlength=len(STATUSES)), strict=True)
    }
