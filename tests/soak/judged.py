"""Random steps, each judged: `python tests/soak 1e5 --seed 0`."""

from __future__ import annotations

import argparse
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

import rumo
from soak.drawn import chance, draw
from soak.driven import CHANGES, counts, drive, some_changes
from soak.judge import Judge
from soak.watched import Watch

STEPS, DRIVES = 500, 3
"""Of a drive with one set of numbers; drives of one problem."""
HURRIED = 0.05
"""Share of problems whose controllers may run out of time, which a seed does not repeat."""


def judged(watch: Watch, seed: int, length: int = STEPS) -> tuple[Counter, list[str]]:
    """Drives of the problem of a seed, so many steps each; what came of them, and what is bad."""
    rng = np.random.default_rng(seed)
    drawn = draw(rng)
    hurried = chance(rng, HURRIED)
    qp = rumo.QpOptions(solver=drawn.solver, max_iterations=CHANGES)
    controller = watch.controller(drawn.problem, drawn.scheme, qp=qp)
    judge = Judge(controller.transcription)
    found, bad = Counter(), []
    for number in range(DRIVES):
        if number:
            controller.update(**some_changes(rng, controller.problem))
        made = drive(rng, drawn, watch, controller, length, hurried)
        verdict = judge.judge(made)
        found.update(counts(made.status) | {"judged": verdict.checked, "proven": verdict.proven})
        found.update(undecided=verdict.undecided, bad=len(verdict.bad))
        bad += [f"seed {seed}, drive {number}, step {i}: {why}" for i, why in sorted(verdict.bad.items())]
    return found, bad


def soak(watch: Watch, steps: int, seed: int, say=lambda text: None, length: int = STEPS) -> tuple[Counter, list[str]]:
    """So many steps at least, of the problems of seeds one after the other, in drives of a length."""
    total, bad, began, said = Counter(), [], time.monotonic(), 0.0
    while total["judged"] < steps:
        found, worse = judged(watch, seed, length)
        total.update(found)
        bad += worse
        seed += 1
        for line in worse[:5]:
            say(line)
        elapsed = time.monotonic() - began
        if elapsed - said > 60.0 or total["judged"] >= steps:
            said = elapsed
            say(f"{elapsed:.0f} s, next seed {seed}: {dict(total)}")
    return total, bad


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("steps", type=float)
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        total, _ = soak(Watch(Path(folder)), int(chosen.steps), chosen.seed, lambda text: print(text, flush=True))
    return int(total["bad"] > 0)
