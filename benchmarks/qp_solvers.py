"""The QP solver of the C core against DAQP, on programs recorded in closed loop.

    python benchmarks/qp_solvers.py

Each program is a small dense one in the free inputs; from sample to sample all of its data change. Compared are, with
the times that the two C codes measure themselves:

    cold   from nothing to the solution. Core: take over the data, factor the Hessian, solve. DAQP: set up, solve.
    warm   the same, starting with the working set of the sample before.
    solve  warm, without factor and set-up. Not the same work: DAQP has transformed all rows and taken over gradient and
           limits during set-up, the core does both while it solves, and transforms only the rows that join.

Soft rows are posed as hard ones, which both solvers take; the solutions are the same (this is checked), because the
prices are above the multipliers. The rows of a working set are not shifted by a stage from sample to sample, as the
controllers do: DAQP has no call for that.
"""

from __future__ import annotations

import sys
from importlib.metadata import version
from pathlib import Path

import daqp
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from qps.recorded import study, textbook

from rumo.bench.qp import CoreQp, QuadraticProgram, as_hard

PASSES = 15
TOLERANCE = 1e-9


def sequences() -> dict[str, list[QuadraticProgram]]:
    """Recorded programs by name, of one size each, with all rows hard and feasible."""
    recorded = {}
    for horizon, duration in ((15, 12.0), (30, 8.0), (50, 8.0)):
        recorded[f"easy, N = {horizon}"] = study(duration, horizon=horizon)
        recorded[f"at the limit, N = {horizon}"] = study(duration, at_the_limit=True, horizon=horizon)
    recorded["stiff reactor, N = 20"] = textbook("stiff_reactor", 200)
    recorded["cooled reactor, N = 20"] = textbook("cooled_reactor", 200)
    return {
        name: as_hard([p for p in programs if p.rows.shape == programs[0].rows.shape])
        for name, programs in recorded.items()
    }


class Daqp:
    """DAQP's one call, which starts from the last multipliers if warm, and its workspace for what a solution takes."""

    def __init__(self) -> None:
        self.multipliers: np.ndarray | None = None
        self.model = daqp.Model()
        self.model.settings = {"primal_tol": TOLERANCE}
        self.ready = False

    def solve(self, p: QuadraticProgram, warm: bool) -> tuple[np.ndarray, float]:
        """(v, seconds of set-up and solution)."""
        data = _data(p)
        start = self.multipliers if warm else None
        v, _, flag, info = daqp.solve(*data, np.zeros_like(data[-1], np.intc), dual_start=start, primal_tol=TOLERANCE)
        assert flag == 1
        self.multipliers = np.array(info["lam"])
        return v, info["setup_time"] + info["solve_time"]

    def kept(self, p: QuadraticProgram) -> float:
        """Seconds of a solution in a workspace that keeps its working set."""
        data = _data(p)
        if self.ready:
            self.model.update(*data)
        else:
            self.model.setup(*data, np.zeros_like(data[-1], np.intc))
            self.ready = True
        return self.model.solve()[3]["solve_time"]


def _data(p: QuadraticProgram) -> tuple[np.ndarray, ...]:
    return p.hessian, p.gradient, p.rows, np.r_[p.upper, p.row_upper], np.r_[p.lower, p.row_lower]


def measure(programs: list[QuadraticProgram]) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Seconds of (core, DAQP) for each program, the median over passes."""
    core, other = CoreQp(programs[0].rows.shape[1], programs[0].rows.shape[0]), Daqp()
    seconds = {kind: ([], []) for kind in ("cold", "warm", "solve")}
    for _ in range(PASSES):
        for times in seconds.values():
            times[0].append([])
            times[1].append([])
        for warm in (False, True):
            for p in programs:
                ours = core.solve(p, warm=warm, qp_tolerance=TOLERANCE)
                v, taken = other.solve(p, warm)
                assert np.abs(v - ours.v).max() < 1e-6
                kind = "warm" if warm else "cold"
                seconds[kind][0][-1].append(ours.factor_seconds + ours.seconds)
                seconds[kind][1][-1].append(taken)
                if warm:
                    seconds["solve"][0][-1].append(ours.seconds)
                    seconds["solve"][1][-1].append(other.kept(p))
    return {kind: (np.median(a, axis=0), np.median(b, axis=0)) for kind, (a, b) in seconds.items()}


def main() -> None:
    """Print medians in microseconds and the median of the ratios, DAQP over core."""
    print(f"DAQP {version('daqp')}; {PASSES} passes; microseconds: core / DAQP (median ratio)\n")
    print(f"{'':38}{'n':>4}{'rows':>5}{'QPs':>5}" + "".join(f"{kind:>24}" for kind in ("cold", "warm", "solve")))
    for name, programs in sequences().items():
        core = CoreQp(programs[0].rows.shape[1], programs[0].rows.shape[0])
        active = np.array([core.solve(p).iterations > 0 for p in programs])
        times = measure(programs)
        m, n = programs[0].rows.shape
        for part, chosen in ((f"{name}", np.ones(len(programs), dtype=bool)), (f"{name}, rows active", active)):
            if not chosen.any() or (part != name and chosen.all()):
                continue
            line = f"{part:38}{n:4}{m:5}{chosen.sum():5}"
            for ours, theirs in times.values():
                a, b = 1e6 * ours[chosen], 1e6 * theirs[chosen]
                line += f"{np.median(a):10.1f} /{np.median(b):6.1f} ({np.median(b / a):3.1f})"
            print(line)


if __name__ == "__main__":
    main()
