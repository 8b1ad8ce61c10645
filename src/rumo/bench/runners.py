"""Controllers replaying a recording; each runner returns times of preparation and feedback (n, 2) in microseconds."""

from __future__ import annotations

import gc
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from functools import lru_cache, partial
from importlib.util import find_spec
from time import perf_counter_ns
from typing import TYPE_CHECKING

import numpy as np

from rumo.controllers import Controller, DirectNlp, RealTimeIteration
from rumo.discretization import Discretization
from rumo.problem import Problem
from rumo.signals import Array
from rumo.simulation.replay import Recording

if TYPE_CHECKING:
    from rumo.bench.acados import AcadosRti

ROUNDS = 5
"""Replays; the controllers take turns, so that the machine's moods meet all of them."""
FAST = ("rti", "rti-python", "rti-tailored", "rti-portable")
LAPS, LAP_SECONDS = 5, 0.5
"""Controllers whose replay is over in a moment take as many turns in each round, unless a turn of all takes longer."""
SLOW = ("rti-reference", "nlp")
SLOW_STEPS = 500
"""Samples that slow controllers replay at most, and once."""
MANY_SUBSTEPS = 50
"""With more substeps a scheme is slow too."""


def _core(recording: Recording, backend: str, scheme: Discretization | None = None) -> Array:
    """The C core by itself: the loop over samples is in C, and so is the clock."""
    controller = RealTimeIteration(recording.problem, scheme, backend=backend)
    if controller.backend == "reference":
        return _python(controller, recording)
    steps = SLOW_STEPS if scheme and scheme.substeps > MANY_SUBSTEPS else len(recording)
    times = controller.replay(recording.x[:steps], recording.reference[:steps], recording.applied[:steps])
    return 1e6 * times[:, 1:]


def _python(controller: Controller, recording: Recording, steps: int | None = None) -> Array:
    """What a caller in Python waits for."""
    times = np.zeros((min(steps or len(recording), len(recording)), 2))
    for i in range(len(times)):
        controller.applied = recording.applied[i]
        start = perf_counter_ns()
        controller.prepare()
        middle = perf_counter_ns()
        controller.feedback(recording.x[i], recording.reference[i])
        times[i] = middle - start, perf_counter_ns() - middle
    return 1e-3 * times


@lru_cache(maxsize=8)
def _acados_solver(problem: Problem, solver: str, integrator: str) -> AcadosRti:
    """Generating and compiling its code takes acados some ten seconds: once for all replays."""
    from rumo.bench.acados import AcadosRti

    return AcadosRti(problem, solver, integrator)


def _acados(recording: Recording, integrator: str) -> Array:
    """The better of acados' two usual QP solvers, by its own clock."""
    best: Array | None = None
    for solver in ("FULL_CONDENSING_DAQP", "PARTIAL_CONDENSING_HPIPM"):
        controller = _acados_solver(recording.problem, solver, integrator)
        controller.reset(recording.x[0])
        times = np.zeros((len(recording), 2))
        for i in range(len(recording)):
            controller.applied = recording.applied[i]
            controller.prepare()
            controller.feedback(recording.x[i], recording.reference[i])
            times[i] = controller.times_us
        if best is None or np.median(times.sum(axis=1)) < np.median(best.sum(axis=1)):
            best = times
    assert best is not None
    return best


Runner = Callable[[Recording], Array]

RUNNERS: dict[str, Runner] = {
    "rti": lambda recording: _core(recording, "auto"),
    "rti-python": lambda recording: _python(RealTimeIteration(recording.problem), recording),
    "rti-tailored": lambda recording: _core(recording, "tailored"),
    "rti-portable": lambda recording: _core(recording, "portable"),
    "rti-reference": lambda r: _python(RealTimeIteration(r.problem, backend="reference"), r, SLOW_STEPS),
    "nlp": lambda recording: _python(DirectNlp(recording.problem), recording, SLOW_STEPS),
    "acados": lambda recording: _acados(recording, "IRK"),
    "acados-discrete": lambda recording: _acados(recording, "DISCRETE"),
}
"""By name: the default backend (`rti`), the same as called from Python, each backend, IPOPT, and acados: with its own
implicit integrator, and with a Newton step that was eliminated by hand."""


def available() -> list[str]:
    """Names of the runners that work here."""
    acados = find_spec("acados_template") is not None
    return [name for name in RUNNERS if acados or not name.startswith("acados")]


def measure(
    recording: Recording,
    names: list[str],
    schemes: Mapping[str, Discretization] | None = None,
    replays: dict[str, list[Array]] | None = None,
) -> dict[str, Array]:
    """Times of each runner in microseconds: each sample's median over the replays.

    Schemes are run by the default backend, under their own names. `replays` is filled on the way, for whoever wants to
    know of a measurement that is interrupted.
    """
    runners = {name: RUNNERS[name] for name in names}
    slow: set[str] = set(SLOW)
    fast: set[str] = set(FAST)
    for name, scheme in (schemes or {}).items():
        runners[name] = partial(_core, backend="auto", scheme=scheme)
        (slow if scheme.substeps > MANY_SUBSTEPS else fast).add(name)
    replays = {} if replays is None else replays
    quick, others = [name for name in runners if name in fast], [name for name in runners if name not in fast]
    for turn in range(ROUNDS):
        for _ in range(LAPS):
            start = perf_counter_ns()
            _take_turns({name: runners[name] for name in quick}, recording, replays)
            if perf_counter_ns() - start > 1e9 * LAP_SECONDS:
                break
        _take_turns({name: runners[name] for name in others if turn == 0 or name not in slow}, recording, replays)
    medians = summed_up(replays)
    return {name: medians[name] for name in runners}


def summed_up(replays: Mapping[str, list[Array]]) -> dict[str, Array]:
    """Each sample's median over the replays, of each runner."""
    return {name: np.median(times, axis=0) for name, times in replays.items()}


def _take_turns(runners: Mapping[str, Runner], recording: Recording, replays: dict[str, list[Array]]) -> None:
    for name, run in runners.items():
        with _quiet():
            times = run(recording)
        replays.setdefault(name, []).append(times)


@contextmanager
def _quiet() -> Generator[None]:
    """Collect garbage before, not within, what is measured."""
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
