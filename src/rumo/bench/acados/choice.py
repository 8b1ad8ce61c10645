"""Which of acados' QP solvers is the fastest for a drive."""

from __future__ import annotations

import numpy as np

from rumo.bench.acados.driver import Replay
from rumo.bench.acados.solver import AcadosRti
from rumo.bench.recording import shortened
from rumo.simulation.replay import Recording

BLOCKS = (1, 3, 5, 10)
"""Stages that partial condensing joins to one: those tried."""
TRIAL, ROUNDS = 200, 10
"""Samples of a trial, and how often each is replayed in turn."""
FAITHFUL = 0.99
"""Share of samples that a QP solver must solve to be chosen."""


class BestAcados:
    """acados with an integrator and the QP solver that is fastest on the first samples of a drive, chosen once.

    Attributes
    ----------
    chosen : str
        The QP solver in words.
    """

    def __init__(self, recording: Recording, integrator: str) -> None:
        daqp = AcadosRti(recording.problem, "FULL_CONDENSING_DAQP", integrator)
        hpipm = AcadosRti(recording.problem, "PARTIAL_CONDENSING_HPIPM", integrator)
        trial = shortened(recording, TRIAL)
        candidates = {"DAQP": (daqp, 0)}
        candidates |= {f"HPIPM, blocks of {b}": (hpipm, b) for b in BLOCKS if b <= recording.problem.horizon}
        totals: dict[str, list[float]] = {name: [] for name in candidates}
        for _ in range(ROUNDS):
            for name, (solver, block) in candidates.items():
                if block:
                    solver.condense(block)
                replay = solver.replay(trial)
                solved = np.mean(replay.statuses == 0) >= FAITHFUL
                totals[name].append(float(np.median(replay.times.sum(axis=1))) if solved else np.inf)
        self.chosen = min(totals, key=lambda name: min(totals[name]))  # others on the machine only add
        self._solver, block = candidates[self.chosen]
        if block:
            self._solver.condense(block)

    def replay(self, recording: Recording) -> Replay:
        """See `AcadosRti.replay`."""
        return self._solver.replay(recording)
