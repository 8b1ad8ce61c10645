"""Which discretisation scheme predicts how well, at what cost, on systems that are stiff."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rumo.checks import known_names
from rumo.registry import DISCRETIZATIONS
from rumo.report.contents import Report
from rumo.report.machine import machine
from rumo.studies.base import Key, Run, Study
from rumo.studies.discretization.cases import CASES
from rumo.studies.discretization.one_case import CaseRun, check_clock
from rumo.studies.discretization.one_mode import INTERVALS, ONE_MODE, PRODUCTS, ModeRun
from rumo.studies.discretization.report import sections
from rumo.studies.discretization.summary import case_outcome, scheme_outcomes

BACKENDS = ("auto", "tailored", "portable")


@dataclass(frozen=True)
class DiscretizationStudy(Study):
    """Settings of the study.

    Parameters
    ----------
    cases : tuple of str
        Names in `CASES`.
    schemes : tuple of str
        Names in `DISCRETIZATIONS`.
    backend : str
        Of the controllers: "auto", "tailored" or "portable", which is slower but needs no compiler.

    Raises
    ------
    ArgumentError
        If a name is unknown, or none is given, or if "auto" is a backend without a clock of its own, by `RUMO_BACKEND`.
    """

    cases: tuple[str, ...] = tuple(CASES)
    schemes: tuple[str, ...] = tuple(DISCRETIZATIONS)
    backend: str = "auto"

    def __post_init__(self) -> None:
        known_names(self.cases, "cases", CASES)
        known_names(self.schemes, "schemes", DISCRETIZATIONS)
        known_names((self.backend,), "backend", BACKENDS)
        check_clock(self.backend)

    def runs(self) -> dict[Key, Run]:
        """What becomes of one mode, and of each case; not one for each scheme, since all are timed in turns."""
        cases: dict[Key, Run] = {(name,): CaseRun(name, self.schemes, self.backend) for name in self.cases}
        return {(ONE_MODE,): ModeRun(self.schemes), **cases}

    def summary(self, results: Mapping[str, Any]) -> dict[str, Any]:
        """What became of one mode, and of each case."""
        return {
            "study": "discretization",
            "machine": machine(),
            "schemes": scheme_outcomes(self.schemes, results.get(ONE_MODE)),
            "abs_r_at": PRODUCTS.tolist(),
            "following_intervals": list(INTERVALS),
            "cases": {name: case_outcome(results[name]) for name in self.cases if name in results},
        }

    def report(self, results: Mapping[str, Any]) -> Report:
        """Which scheme predicts how well, at what cost."""
        content = self.summary(results)
        backends = {case["backend"] for case in content["cases"].values()} or {self.backend}
        lead = f"Discretisation schemes in the real-time iteration ({', '.join(backends)} backend), on stiff systems."
        return Report("Which discretisation?", lead, content, sections(content))
