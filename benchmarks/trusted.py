"""How true `plan.trusted` and `command_error` are: each step of the drives of two studies, against converged solutions.

    python benchmarks/trusted.py [--seeds 0 1] [--nlp 0.05]

A step is judged by sequential quadratic programming from its own plan until nothing changes; a share of them by IPOPT
as well. What one iteration would have come to is made again, from the same guess.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

import rumo
from rumo.shift import Shift
from rumo.simulation import Scenario
from rumo.studies.faults import FaultStudy
from rumo.studies.faults.study import FaultRun
from rumo.studies.linearization import LinearizationStudy
from rumo.studies.linearization.study import SweptRun

OFF = 0.05
"""A command that is farther than this from the converged one is wrong, over the input's range."""


@dataclass(frozen=True)
class Judged:
    """A step, and how far commands are from the converged one: its own, and that of one iteration (NaN: not known).

    The first iteration was trusted where the step took no other.
    """

    plan: rumo.Plan
    error: float
    first_error: float
    first_trusted: bool
    nlp_difference: float


class JudgedIteration(rumo.RealTimeIteration):
    """The real-time iteration; each of its steps is judged."""

    name = "judged"

    def __init__(self, problem: rumo.Problem, discretization: Any = None, **settings: Any) -> None:
        super().__init__(problem, discretization, **settings)
        self._converged = rumo.RealTimeIteration(problem, gate=None, sqp_iterations=300)
        self._first = rumo.RealTimeIteration(problem, gate=None, settling_iterations=0)
        self._nlp, self._share, self._random = rumo.DirectNlp(problem, gate=None), 0.0, np.random.default_rng(0)
        self._shift, self._last = Shift(self.transcription), None
        self.judged: list[Judged] = []

    def judge_by_nlp(self, share: float) -> None:
        """A share of the steps."""
        self._share = share

    def reset(self, *args: Any, **kwargs: Any) -> None:
        """See `Controller.reset`."""
        super().reset(*args, **kwargs)
        self._last = None

    def step(self, x: Any, reference: Any) -> rumo.Plan:
        """See `Controller.step`."""
        applied, last = self.applied, self._last
        self._last = plan = super().step(x, reference)
        if plan.status in (rumo.Status.BAD_MEASUREMENT, rumo.Status.BAD_REFERENCE):
            return plan
        known = plan.x.values[0], reference
        self._converged.engage(applied=applied, plan=plan)
        best = self._converged.step(*known)
        if not best.status.solved or best.diagnostics.step > 1e-3:
            return plan
        first_error, first_trusted, difference = np.nan, True, np.nan
        if last is not None:
            self._first.engage(applied=applied, plan=self._shifted(last))
            first = self._first.step(*known)
            first_error = self._distance(first, best)
            again = np.isfinite(plan.diagnostics.contraction) or self._distance(plan, first) > 1e-3
            first_trusted = plan.trusted and not again
        if self._random.random() < self._share:
            self._nlp.engage(applied=applied, plan=plan)
            optimum = self._nlp.step(*known)
            difference = self._distance(optimum, best) if optimum.status.solved else np.nan
        self.judged.append(Judged(plan, self._distance(plan, best), first_error, first_trusted, difference))
        return plan

    def _distance(self, plan: rumo.Plan, best: rumo.Plan) -> float:
        d = self.problem.delay
        return float(np.max(np.abs(plan.u.values[d] - best.u.values[d]) / self.problem.input_scales))

    def _shifted(self, plan: rumo.Plan) -> dict[str, np.ndarray]:
        """The guess that the next sample has of a plan."""
        x, begin = plan.x.values, self._shift.stages
        moved = x[begin] + self._shift.shares[:, None] * (x[begin + 1] - x[begin])
        return {"x": moved, "u": plan.u.values[self._shift.intervals]}


def drives(seeds: list[int]) -> Iterator[tuple[str, Scenario]]:
    """Of both studies."""
    for seed in seeds:
        for key, run in LinearizationStudy(("rti",), seed=seed).runs().items():
            assert isinstance(run, SweptRun)
            yield f"linearization {key[0]} {key[1]:g}", run.scenario
    for key, run in FaultStudy(("rti",), speeds=(8.0, 11.0), seeds=tuple(seeds)).runs().items():
        assert isinstance(run, FaultRun)
        yield f"faults {key[1]} at {key[2]:g} m/s", run.scenario


def summary(title: str, judged: list[Judged]) -> None:
    """Of some drives' steps."""
    told = [j for j in judged if np.isfinite(j.plan.diagnostics.command_error)]
    wrong_at_first = [j for j in judged if j.first_error > OFF]
    right = [j for j in judged if j.error <= OFF]
    wrong = [j for j in judged if j.error > OFF]
    covered = [j for j in told if j.error <= j.plan.diagnostics.command_error]
    differences = [j.nlp_difference for j in judged if np.isfinite(j.nlp_difference)]
    print(f"{title}: {len(judged)} steps")
    doubted = [j for j in judged if not j.first_trusted]
    print(
        f"  one iteration is off by more than {OFF:.0%} in {len(wrong_at_first)}, "
        f"{sum(not j.first_trusted for j in wrong_at_first)} of which are not trusted, as are {len(doubted)} of all"
    )
    print(
        f"  the plan is off in {len(wrong)}, {sum(j.plan.trusted for j in wrong)} of them trusted; "
        f"right, but not trusted: {sum(not j.plan.trusted for j in right)}"
    )
    if told:
        ratios = [j.plan.diagnostics.command_error / max(j.error, 1e-12) for j in told]
        print(
            f"  command_error is told in {len(told)}, and covers the error in {len(covered) / len(told):.2%} "
            f"(median {np.median(ratios):.0f} times it)"
        )
    if differences:
        print(f"  IPOPT finds the same in {np.mean(np.array(differences) <= 1e-3):.2%} of {len(differences)}")


def main() -> None:
    """See the module."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1])
    parser.add_argument("--nlp", type=float, default=0.05, metavar="SHARE")
    options = parser.parse_args()
    of_study: dict[str, list[Judged]] = {}
    kept: JudgedIteration | None = None
    for title, scenario in drives(options.seeds):
        study = title.split()[0]
        scenario = replace(scenario, controller=JudgedIteration)
        if kept is None or kept.problem is not scenario.problem:
            kept = cast("JudgedIteration", scenario.make_controller())
            kept.judge_by_nlp(options.nlp)
        kept.judged = []
        with suppress(rumo.PlantError):
            scenario.run(kept)
        of_study.setdefault(study, []).extend(kept.judged)
        for j in kept.judged:
            if j.error > OFF and j.plan.trusted:
                print(f"{title}: trusted, and off by {j.error:.3f}; step {j.plan.diagnostics.step:.3f}", flush=True)
    for study, judged in of_study.items():
        summary(study, judged)


if __name__ == "__main__":
    main()
