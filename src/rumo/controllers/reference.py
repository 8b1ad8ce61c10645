"""The real-time iteration in NumPy, line by line the paper: slow, readable, and the oracle of the compiled one."""

from __future__ import annotations

import numpy as np

from rumo.controllers.condensed import CondensedController
from rumo.controllers.fallback import Trajectory
from rumo.controllers.policy import Candidate
from rumo.controllers.rti import RealTimeIteration
from rumo.signals import Array

# A guess farther from the dynamics than this share of what the inputs can do has strayed.
STRAYED = 0.03


class ReferenceRti(RealTimeIteration, CondensedController):
    """`RealTimeIteration(problem, backend="reference")`."""

    _backend = "reference"
    _settled = False  # whether guesses have satisfied the dynamics since the last one at rest

    def _prepare(self, guess: Trajectory) -> bool:
        if not self._linearize(guess) or self._condensed is None:
            return False
        # A plan made from a wild measurement would keep misleading its successors.
        strayed = self._condensed.straying >= STRAYED
        lost = self._settled and strayed and not guess.resting
        self._settled = not strayed
        return not lost

    def _solve(self, x: Array, window: dict[str, Array], guess: Trajectory) -> Candidate | None:
        candidate = self._iterate(x, window)
        for _ in range(self.sqp_iterations - 1):
            if not candidate.status.solved or self._change(candidate.trajectory) < self.tolerance:
                break
            if not self._linearize(candidate.trajectory):
                break
            better = self._iterate(x, window)
            if not better.status.solved:
                break
            candidate = better
        return candidate

    def _change(self, new: Trajectory) -> float:
        """Largest change of an input over its range, or of a state over the reach of the inputs."""
        assert self._condensed is not None
        old, reach = self._about, self._condensed.reach
        inputs = np.abs(new.u - old.u).max(axis=0) / self.problem.input_scales
        states = np.abs(new.x - old.x).max(axis=0)[reach > 0.0] / reach[reach > 0.0]
        return float(max(inputs.max(), states.max(initial=0.0)))
