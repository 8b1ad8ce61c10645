"""Lines around tracks, and how fast a car can be on each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path as FilePath
from typing import Any

from rumo.checks import as_list, non_negative_number, positive_number
from rumo.errors import ArgumentError
from rumo.references import TRACKS, SpeedLimits
from rumo.report.contents import Report
from rumo.studies.base import Key, Run, Study
from rumo.studies.drive import Drive, DrivenRoad, driven_road
from rumo.studies.race_line.lines import LINES, LineRun, TimedLine
from rumo.studies.race_line.report import sections
from rumo.vehicles import VehicleParameters
from rumo.vehicles.problems import usual_limits

SPARE = 0.3
"""Between the sides of the car and the edges [m]."""


@dataclass(frozen=True)
class RaceLineStudy(Study):
    """Settings of the study: a run for each track and line.

    Parameters
    ----------
    tracks : tuple of str or Path
        Names in `rumo.references.TRACKS`, or files as `load_track` reads them; closed.
    vehicle : str or Path
        A name in `rumo.vehicles.VEHICLES`, or a TOML file.
    grip : float
        Share of friction that is used.
    margin : float, optional
        Between the centre of gravity and the edges; half the car's width and `SPARE` if not given [m].
    spacing : float
        Of the nodes of the nonlinear program, at most [m].
    drive : bool
        Whether the car drives a lap of each line, by its profile, its state known exactly.
    width, smoothing : float, optional
        Of track files, see `load_track` [m].

    Raises
    ------
    ArgumentError
        If a name is unknown, a file cannot be used, a track is open, or a number cannot be driven.
    """

    tracks: tuple[str | FilePath, ...] = tuple(TRACKS)
    vehicle: str | FilePath = "passenger"
    grip: float = 0.9
    margin: float | None = None
    spacing: float = 1.0
    drive: bool = False
    width: float | None = None
    smoothing: float | None = None

    def __post_init__(self) -> None:
        as_list(self.tracks, "tracks", "at least one track such as 'club'")
        positive_number(self.grip, "grip")
        positive_number(self.spacing, "spacing")
        if self.margin is not None:
            non_negative_number(self.margin, "margin")
        for name, road in self.roads.items():
            if not road.track.path.closed:
                raise ArgumentError("tracks", repr(name), "closed ones, for laps")

    @cached_property
    def _base(self) -> Drive:
        return Drive(vehicle=self.vehicle, grip=self.grip, estimator="none")

    @property
    def car(self) -> VehicleParameters:
        """The vehicle."""
        return self._base.car

    @cached_property
    def roads(self) -> dict[str, DrivenRoad]:
        """Tracks by their names."""
        files = {"width": self.width, "smoothing": self.smoothing}
        every = [driven_road(name, self.car, **({} if str(name) in TRACKS else files)) for name in self.tracks]
        return {road.name: road for road in every}

    @property
    def limits(self) -> SpeedLimits:
        """By which lines are found, timed and driven: what the car's tyres hold, its motor and its brakes."""
        return SpeedLimits.of_car(self.car, self.grip)

    def runs(self) -> dict[Key, Run]:
        """A line for each track and kind."""
        car = self.car
        margin = 0.5 * car.width + SPARE if self.margin is None else self.margin
        turning = usual_limits(car)[1] / car.wheelbase
        driven = self._base.driven_car if self.drive else None
        return {
            (name, line): LineRun(line, road.track, self.limits, margin, turning, self.spacing, driven)
            for name, road in self.roads.items()
            for line in LINES
        }

    def summary(self, results: Mapping[str, Mapping[str, TimedLine]]) -> dict[str, Any]:
        """Length and times of the lines, by track and line."""
        return {
            "study": "race-line",
            "vehicle": self._base.car_name,
            "grip": self.grip,
            "margin_m": 0.5 * self.car.width + SPARE if self.margin is None else self.margin,
            "spacing_m": self.spacing,
            "tracks": {
                name: {line: dict(found.outcome) for line, found in lines.items()} for name, lines in results.items()
            },
        }

    def report(self, results: Mapping[str, Mapping[str, TimedLine]]) -> Report:
        """The summary, and for each track a table, what it says, and figures."""
        content = self.summary(results)
        lead = (
            f"{self._base.car_name} at a grip of {self.grip:g}, {content['margin_m']:.2f} m from the edges at least. "
            "All lines are timed by the same speed profile, within what the car's tyres, motor and brakes can do."
        )
        tracks = {name: road.track for name, road in self.roads.items()}
        return Report("Race lines", lead, content, sections(content, results, tracks))
