"""Runners take turns on one recorded drive."""

from __future__ import annotations

import gc
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from time import perf_counter

import numpy as np

from rumo.bench.recording import shortened
from rumo.bench.runners import RUNNERS, Outcome, Runner, core
from rumo.discretization import Discretization
from rumo.signals import Array
from rumo.simulation.replay import Recording

ROUNDS = 5
"""Replays; the runners take turns, so that the machine's moods meet all of them."""
LAPS, LAP_SECONDS = 5, 0.4
"""Runners whose replay is over in this time take as many turns in each round."""
TRIAL = 20
"""Samples that are replayed first, to warm up and to see how long a runner takes."""
SECONDS, LEAST = 5.0, 200
"""Time for all replays of a runner: slow ones replay fewer samples, but not fewer than these."""


def measure(
    recording: Recording,
    names: list[str],
    schemes: Mapping[str, Discretization] | None = None,
    replays: dict[str, list[Outcome]] | None = None,
) -> dict[str, Array]:
    """Times of each runner in microseconds, (n, 2): each sample's median over the replays.

    Schemes are run by the default backend, under their own names. `replays` is filled on the way, for whoever wants to
    know of a measurement that is interrupted.
    """
    replays = {} if replays is None else replays
    runners = {name: RUNNERS[name](recording) for name in names}
    runners |= {name: core(recording, scheme=scheme) for name, scheme in (schemes or {}).items()}
    turns: dict[str, partial[Outcome]] = {}
    quick: list[str] = []
    for _ in range(ROUNDS):
        for lap in range(LAPS):
            for name in runners if lap == 0 else quick:
                if name not in turns:
                    seconds = _seconds_a_step(runners[name], recording)
                    steps = int(np.clip(SECONDS / ROUNDS / seconds, LEAST, len(recording)))
                    turns[name] = partial(runners[name], shortened(recording, steps))
                    if seconds * steps < LAP_SECONDS:
                        quick.append(name)
                with _quiet():
                    replays.setdefault(name, []).append(turns[name]())
    return {name: medians(replays[name]) for name in runners}


def medians(outcomes: Sequence[Outcome]) -> Array:
    """Each sample's median over the replays, (n, 2) in microseconds."""
    return np.median([outcome.times for outcome in outcomes], axis=0)


def _seconds_a_step(run: Runner, recording: Recording) -> float:
    trial = shortened(recording, TRIAL)
    run(trial)
    start = perf_counter()
    run(trial)
    return (perf_counter() - start) / len(trial)


@contextmanager
def _quiet() -> Generator[None]:
    """Collect garbage before, not within, what is measured."""
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
