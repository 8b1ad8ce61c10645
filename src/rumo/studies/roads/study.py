"""A car on the road: manoeuvres and tracks, each with goals, by one command."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

from rumo.checks import known_names
from rumo.registry import CONTROLLERS
from rumo.report.contents import Report
from rumo.studies.base import Key, Resumable, Run
from rumo.studies.roads.case import Conditions, Variant, by_variant
from rumo.studies.roads.cases import CASES
from rumo.studies.roads.outcome import RoadDrive
from rumo.studies.roads.report import sections

Results = Mapping[str, Mapping[str, Mapping[Variant, RoadDrive]]]
"""By case, controller and variant."""


@dataclass(frozen=True)
class RoadStudy(Resumable):
    """Settings of the study.

    Parameters
    ----------
    cases : tuple of str
        Names in `CASES`.
    controllers : tuple of str, optional
        Names in `rumo.registry.CONTROLLERS`; those that each case has if not given.
    seeds : tuple of int
        Of wind and noise. Cases that are not driven with each of them take the first.
    tracks : tuple of str
        Names in `rumo.studies.drive.ROADS`, or files as `load_track` reads them.
    nlp_distance : float, optional
        How far the NLP drives on tracks [m]; whole laps if not given.
    keep_logs : bool
        Of every drive, up to some megabytes each.

    Raises
    ------
    ArgumentError
        If a name is unknown, a file cannot be used, or a number cannot be.
    """

    keeps_logs: ClassVar[bool] = True

    cases: tuple[str, ...] = tuple(CASES)
    controllers: tuple[str, ...] | None = None
    seeds: tuple[int, ...] = Conditions.seeds
    tracks: tuple[str, ...] = Conditions.tracks
    nlp_distance: float | None = None
    keep_logs: bool = False

    def __post_init__(self) -> None:
        known_names(self.cases, "cases", CASES)
        if self.controllers is not None:
            known_names(self.controllers, "controllers", CONTROLLERS)
        for name in self.driven:
            CASES[name].check(self.conditions)

    @cached_property
    def conditions(self) -> Conditions:
        """What the cases have in common."""
        return Conditions(self.seeds, self.tracks, self.nlp_distance)

    @property
    def driven(self) -> tuple[str, ...]:
        """Names of the cases that can be driven here."""
        return tuple(name for name in self.cases if not CASES[name].lacking)

    @property
    def left_out(self) -> dict[str, str]:
        """Why others are not, in a sentence, by name."""
        return {name: CASES[name].lacking for name in self.cases if CASES[name].lacking}

    def runs(self) -> dict[Key, Run]:
        """A drive for each case, controller and variant of the case."""
        return {
            (name, controller, variant): RoadRun(name, controller, variant, self.conditions, self.keep_logs)
            for name in self.driven
            for controller in (self.controllers or CASES[name].controllers)
            for variant in CASES[name].variants(self.conditions)
        }

    @property
    def same(self) -> dict[str, Any]:
        """What all drives have in common: the seed of those that are driven once, files by name, the NLP's distance."""
        return {
            "study": "roads",
            "seed": self.seeds[0],
            "tracks": dict(self.conditions.files),
            "nlp_distance_m": self.nlp_distance,
        }

    def record(self, result: RoadDrive) -> dict[str, Any]:
        """Figures and motion of a drive."""
        return result.outcome

    def restored(self, record: Mapping[str, Any]) -> RoadDrive:
        """A drive without its log."""
        return RoadDrive(dict(record))

    def summary(self, results: Results) -> dict[str, Any]:
        """The table, and what came of each drive."""
        return {
            "study": "roads",
            "seeds": list(self.seeds),
            "tracks": list(self.conditions.files),
            "nlp_distance_m": self.nlp_distance,
            "left_out": self.left_out,
            "cases": {name: self._case(name, results[name]) for name in self.cases if name in results},
        }

    def _case(self, name: str, drives: Mapping[str, Mapping[Variant, RoadDrive]]) -> dict[str, Any]:
        case, found = CASES[name], {controller: by_variant(each) for controller, each in drives.items()}
        return {
            "title": case.title,
            "told": case.told,
            "rows": {
                controller: [row.content for row in case.rows(controller, outcomes, self.conditions)]
                for controller, outcomes in found.items()
            },
            "drives": {
                controller: {
                    str(variant): {key: value for key, value in each.items() if key != "motion"}
                    for variant, each in outcomes.items()
                }
                for controller, outcomes in found.items()
            },
        }

    def report(self, results: Results) -> Report:
        """The table with its goals, findings, and figures of each case."""
        content = self.summary(results)
        lead = (
            "Manoeuvres and laps, each with what it is to reach. Who drives them knows where the car is by a Kalman "
            "filter from noisy sensors, a sample late, in wind, unless a case says otherwise."
        )
        return Report("On the road", lead, content, sections(content, results, self.conditions))


@dataclass(frozen=True)
class RoadRun:
    """A drive of a case, as plain data.

    Parameters
    ----------
    case, controller : str
        Names.
    variant : str, int or float
        Which drive of the case.
    conditions : Conditions
        What all cases have in common.
    keep_log : bool
        Whether the log is part of what comes of it.
    """

    case: str
    controller: str
    variant: Variant
    conditions: Conditions
    keep_log: bool = False

    def run(self, *, progress: Callable[[int, int], None] | None = None) -> RoadDrive:
        """Drive."""
        driven = CASES[self.case].drive(self.controller, self.variant, self.conditions, progress)
        return driven if self.keep_log else replace(driven, log=None)
