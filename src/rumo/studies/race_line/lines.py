"""Lines around a track, each found, timed by the same speed profile and, where wanted, driven."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from rumo.references import Path, SpeedLimits, SpeedProfile, Track, deviations, minimum_curvature, speed_profile
from rumo.report.charts import REFERENCE, Look
from rumo.signals import Array
from rumo.studies.drive import DrivenCar, DriveRun, DriveSetting
from rumo.studies.drive.run import to_its_end
from rumo.studies.kpis import Driven, kpis
from rumo.studies.race_line.minimum_time import FOUND, minimum_time

CENTRE, CURVATURE, TIME = "centre", "curvature", "time"
LINES = {CENTRE: "Centre line", CURVATURE: "Least curvature", TIME: "Least time"}
"""Names for readers."""
LOOKS = {
    CENTRE: REFERENCE,
    CURVATURE: Look("#E69F00", "dash", 1.6),
    TIME: Look("#0072B2", "solid", 1.6),
}
DRIVEN = ("lap_time", "lateral_deviation_rms", "time_off_track", "least_room")
"""What is said of a lap that was driven, see `rumo.studies.kpis`."""
PATIENCE = 1.3
"""A lap may take so many times what the profile takes."""


@dataclass(frozen=True, eq=False)
class TimedLine:
    """What came of a line.

    Attributes
    ----------
    path : Path
        The line.
    s, aside, speed : ndarray, (K,)
        Along the centre line [m], how far the line is to the left of it [m], and the profile's speed there [m/s].
    outcome : dict
        `length_m`, `lap_time_s` by the profile, `slowest_m_s`, `fastest_m_s`; of the line of least time
        `program_time_s`, `iterations` and `found`; of a lap that was driven `ended` and the figures in `DRIVEN`.
    """

    path: Path
    s: Array
    aside: Array
    speed: Array
    outcome: dict[str, Any] = field(default_factory=dict[str, Any])


@dataclass(frozen=True, eq=False)
class LineRun:
    """A line to be found.

    Attributes
    ----------
    line : str
        A name in `LINES`.
    track : Track
        Closed.
    limits : SpeedLimits
        Of the car.
    margin : float
        Between line and edges [m].
    turning, spacing : float
        See `minimum_time`.
    driven : DrivenCar, optional
        That drives a lap of it.
    """

    unit: ClassVar[str] = ""

    line: str
    track: Track
    limits: SpeedLimits
    margin: float
    turning: float
    spacing: float
    driven: DrivenCar | None = None

    def run(self, *, progress: Callable[[int, int], None] | None = None) -> TimedLine:
        """Find it, time it, drive it."""
        found: dict[str, Any] = {}
        path = self.track.path
        if self.line == CURVATURE:
            path = minimum_curvature(self.track, self.margin)
        elif self.line == TIME:
            best = minimum_time(self.track, self.limits, self.margin, turning=self.turning, spacing=self.spacing)
            path = best.path
            found = {
                "program_time_s": best.duration,
                "iterations": best.iterations,
                "found": best.outcome == FOUND,
            }
        profile = speed_profile(path, self.limits)
        places = path.at(profile.s)
        beside = deviations(self.track.path, {"p_x": places.x, "p_y": places.y}, near=0.0)
        outcome = {
            "length_m": path.length,
            "lap_time_s": profile.duration,
            "slowest_m_s": float(profile.v.min()),
            "fastest_m_s": float(profile.v.max()),
            **found,
        }
        if self.driven is not None:
            outcome |= self._driven(self.driven, path, profile, progress)
        return TimedLine(path, beside["progress"], beside["lateral_deviation"], np.array(profile.v), outcome)

    def _driven(
        self, car: DrivenCar, path: Path, profile: SpeedProfile, progress: Callable[[int, int], None] | None
    ) -> dict[str, Any]:
        """What came of a lap, the car's state known exactly."""
        setting = DriveSetting(path, profile, car, PATIENCE * profile.duration, track=self.track)
        run = DriveRun(setting.scenario(), self.track, path, profile, 0.0, path.length)
        log = to_its_end(lambda: run.run(progress=progress))
        told = kpis(Driven(log, self.track, path, profile, car.car), DRIVEN)
        return {**{f"driven_{key}": value for key, value in told.items()}, "ended": str(log.attrs["ended"])}
