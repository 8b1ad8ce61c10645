"""What the safeguard and the gate cost a step of the paper's drive.

    python benchmarks/safeguard.py [--horizon 15] [--rounds 40]

The same samples go to controllers with and without them, in turns; of each sample the shortest time counts.
"""

from __future__ import annotations

import argparse
from typing import Any, ClassVar

import numpy as np

import rumo
from rumo.studies.paper import PaperStudy

CONTROLLERS: dict[str, dict[str, Any]] = {
    "safeguard and gate": {},
    "gate alone": {"trusted_step": np.inf},
    "safeguard alone": {"gate": None},
    "neither": {"gate": None, "trusted_step": np.inf},
}


class Recorded(rumo.RealTimeIteration):
    """The real-time iteration; its samples are kept."""

    name = "recorded"
    samples: ClassVar[list[tuple[Any, Any]]] = []

    def step(self, x: Any, reference: Any) -> rumo.Plan:
        """See `Controller.step`."""
        self.samples.append((np.array(x, dtype=float), reference))
        return super().step(x, reference)


def main() -> None:
    """See the module."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--horizon", type=int, default=15)
    parser.add_argument("--rounds", type=int, default=40)
    options = parser.parse_args()
    drive = PaperStudy(horizon=options.horizon, duration=8.0)
    problem = drive.problem()
    drive.scenario(Recorded, problem, drive.plant()).run()
    controllers = {title: rumo.RealTimeIteration(problem, **settings) for title, settings in CONTROLLERS.items()}
    times = {title: np.full((len(Recorded.samples), 2), np.inf) for title in controllers}
    for _ in range(options.rounds):
        for controller in controllers.values():
            controller.reset()
        for i, sample in enumerate(Recorded.samples):
            for title, controller in controllers.items():
                spent = controller.step(*sample).timings
                times[title][i] = np.minimum(times[title][i], [spent.total, spent.feedback])
    for title, spent in times.items():
        (step, feedback), late = 1e6 * np.median(spent, axis=0), 1e6 * np.quantile(spent[:, 0], 0.9)
        print(f"{title:20} step {step:6.2f} us (90 %: {late:6.2f}), feedback {feedback:6.2f} us")


if __name__ == "__main__":
    main()
