"""A drive that ends when it is over: when the car has arrived, or is lost."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import hypot, isfinite, pi
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from rumo.controllers import Controller
from rumo.errors import PlantError
from rumo.references import Path, SpeedProfile, Track
from rumo.simulation import ClosedLoop, Sample, Scenario
from rumo.simulation.run import record
from rumo.studies.kpis import Driven
from rumo.vehicles import VehicleParameters

if TYPE_CHECKING:
    import xarray as xr

FINISHED, LOST, LATE = "finished", "lost", "late"
FAR = 10.0
"""Beyond the edge, a car is lost [m]."""
BACKWARDS = 0.5 * pi
"""So is one that points farther than this away from its path [rad],"""
STANDING, PATIENCE = 0.5, 3.0
"""and one that is slower than this, where it is to be twice as fast [m/s], for so long [s]."""
WINDOW = 10.0
"""How far a car gets from one sample to the next, at most [m]."""


@dataclass(frozen=True, eq=False)
class DriveRun:
    """A scenario, until the car has driven a distance, or is lost.

    Parameters
    ----------
    scenario : Scenario
        The drive.
    track : Track
        Whose edges count.
    path : Path
        That is followed.
    profile : SpeedProfile
        How fast.
    begin, distance : float
        Where it begins on the path, and how far it is to get [m].
    car : VehicleParameters, optional
        Of the size of the plant, for figures of merit.
    """

    unit: ClassVar[str] = "m"

    scenario: Scenario
    track: Track
    path: Path
    profile: SpeedProfile
    begin: float
    distance: float
    car: VehicleParameters | None = None

    def driven(self, log: xr.Dataset) -> Driven:
        """A log of this drive, and what else figures of merit need."""
        return Driven(log, self.track, self.path, self.profile, self.car, self.scenario.plant, self.begin)

    def run(
        self, controller: Controller | None = None, *, progress: Callable[[int, int], None] | None = None
    ) -> xr.Dataset:
        """Drive; the log's attributes `outcome` and `ended` say how it ended, in a word and in a sentence.

        Parameters
        ----------
        controller : Controller, optional
            One that is there already, to save setting it up again; it is reset first.
        progress : callable, optional
            Called with (metres driven, all metres).
        """
        watch = _Watch(self, progress)
        log = record(ClosedLoop(self.scenario, controller), until=watch)
        return log.assign_attrs(outcome=watch.outcome, ended=watch.ended)


def to_its_end(drive: Callable[[], xr.Dataset]) -> xr.Dataset:
    """The log of a drive; a plant that cannot go on is a car that is lost."""
    try:
        return drive()
    except PlantError as error:
        log: Any = getattr(error, "log", None)
        if log is None or not log.sizes["time"]:
            raise
        end = float(log["time"].to_numpy()[-1])
        return log.assign_attrs(outcome=LOST, ended=f"Lost after {end:.2f} s: the plant could not go on, as in a spin.")


class _Watch:
    """Follows a car along its path, and says when its drive is over."""

    def __init__(self, run: DriveRun, progress: Callable[[int, int], None] | None) -> None:
        self._run, self._progress = run, progress
        self._s, self._slow = run.begin, 0.0
        self.outcome, self.ended = LATE, f"Not there after {run.scenario.duration:.0f} s, which ended the drive."

    def __call__(self, sample: Sample) -> bool:
        run, x = self._run, sample.true
        self._s = run.path.nearest(x["p_x"], x["p_y"], self._s - WINDOW, self._s + WINDOW)
        driven = self._s - run.begin
        if self._progress is not None:
            self._progress(round(min(max(driven, 0.0), run.distance)), round(run.distance))
        if driven >= run.distance:
            self.outcome = FINISHED
            self.ended = f"Arrived after {driven:.0f} m and {sample.time:.2f} s."
            return True
        why = self._lost(sample)
        if why:
            self.outcome = LOST
            self.ended = f"Lost at s = {self._s:.0f} m, after {sample.time:.2f} s: the car {why}."
        return bool(why)

    def _lost(self, sample: Sample) -> str:
        """Why the car is lost, in words that go on from "the car"; nothing if it is not."""
        run, x = self._run, sample.true
        beyond = self._beyond(x["p_x"], x["p_y"])
        if beyond > FAR:
            return f"is {beyond:.1f} m beyond the edge"
        turned = abs(float(run.path.at(self._s).turned(x["psi"])))
        if turned > BACKWARDS:
            return f"points {np.rad2deg(turned):.0f} degrees away from its path"
        slow = hypot(x["v_x"], x["v_y"]) < STANDING and float(run.profile.speed_at(self._s)) > 2.0 * STANDING
        self._slow = self._slow + run.scenario.problem.sampling_time if slow else 0.0
        return "stands still" if self._slow > PATIENCE else ""

    def _beyond(self, x: float, y: float) -> float:
        """How far a place is beyond the nearer edge of the track [m]."""
        path = self._run.track.path
        s = self._s if path is self._run.path else path.nearest(x, y, self._s - 2.0 * WINDOW, self._s + 2.0 * WINDOW)
        clearance = float(self._run.track.clearance(s, x, y))
        return -clearance if isfinite(clearance) else np.inf
