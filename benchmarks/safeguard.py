"""What the safeguard and the gate cost a step of the paper's drive.

    python benchmarks/safeguard.py [--horizon 15] [--rounds 40]

The same samples go to controllers with and without them, in turns; of each sample the shortest time counts.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

import rumo
from rumo.bench.recording import record

SAMPLES = 200
CONTROLLERS: dict[str, dict[str, Any]] = {
    "safeguard and gate": {},
    "gate alone": {"trusted_step": np.inf},
    "safeguard alone": {"gate": None},
    "neither": {"gate": None, "trusted_step": np.inf},
}


def main() -> None:
    """See the module."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--horizon", type=int, default=15)
    parser.add_argument("--rounds", type=int, default=40)
    options = parser.parse_args()
    told = record("easy", options.horizon, SAMPLES)
    controllers = {title: rumo.RealTimeIteration(told.problem, **settings) for title, settings in CONTROLLERS.items()}
    times = {title: np.full((len(told), 2), np.inf) for title in controllers}
    for _ in range(options.rounds):
        for title, controller in controllers.items():
            controller.reset()
            spent = controller.replay(told.x, told.reference, told.applied)[:, 1:]
            times[title] = np.fmin(times[title], np.column_stack([spent.sum(axis=1), spent[:, 1]]))
    for title, spent in times.items():
        (step, feedback), late = 1e6 * np.median(spent, axis=0), 1e6 * np.quantile(spent[:, 0], 0.9)
        print(f"{title:20} step {step:6.2f} us (90 %: {late:6.2f}), feedback {feedback:6.2f} us")


if __name__ == "__main__":
    main()
