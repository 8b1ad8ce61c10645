"""A car laps a track: what `rumo drive` drives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path as FilePath
from threading import get_ident
from typing import TYPE_CHECKING, Any, ClassVar

from rumo.checks import known_names, positive_number, whole_number
from rumo.errors import ArgumentError, UnknownNameError
from rumo.references import SpeedLimits, SpeedProfile, speed_profile
from rumo.registry import CONTROLLERS
from rumo.report.contents import Report
from rumo.studies.base import Key, Run, Study
from rumo.studies.drive.estimators import EXACT, estimator_of, noise_of
from rumo.studies.drive.plants import DrivenCar, driven_car, usual_vehicle
from rumo.studies.drive.report import sections
from rumo.studies.drive.roads import DrivenRoad, driven_road
from rumo.studies.drive.run import FINISHED, DriveRun
from rumo.studies.drive.setting import DriveSetting
from rumo.studies.kpis import CONSTRAINTS, INPUTS, MOTION, PLACE, STEPS, Driven, kpis
from rumo.vehicles import VEHICLES, VehicleParameters

if TYPE_CHECKING:
    import xarray as xr

KPIS = (*PLACE, *MOTION, *INPUTS, *CONSTRAINTS, *STEPS)
"""What is said of a drive."""
BROKEN_OFF = "broken off"
"""How a drive ended that nothing in it has ended."""
SAMPLING_TIME = 0.04
"""Of `path_problem` [s]."""
PATIENCE, MORE = 1.3, 10.0
"""A drive may take so many times what the profile takes, and so much longer [s]."""


@dataclass(frozen=True)
class Drive(Study):
    """Settings of a drive.

    Parameters
    ----------
    track : str or Path
        A name in `ROADS`, or a file as `load_track` reads it.
    vehicle : str or Path, optional
        A name in `rumo.vehicles.VEHICLES`, or a TOML file. The plant's own if it names a car, else "passenger".
    plant : str
        A name in `PLANTS`.
    controller : str
        A name in `rumo.registry.CONTROLLERS`.
    grip : float
        Share of friction that the speed profile uses.
    laps : int
        To be driven; 1 on an open path.
    estimator : str
        A name in `ESTIMATORS`; with "none" the controller knows the state exactly, with the others sensors have the
        paper's noise.
    mu : float, optional
        Friction of the road, known to plant, controller and profile; the car's own if not given.
    seed : int
        Of wind and noise.
    width, smoothing : float, optional
        Of a track file, see `load_track` [m].
    distance : float, optional
        How far to drive, if not all laps [m].
    backend : str, optional
        Of the real-time iteration.
    varied : tuple of str
        Numbers of the car that are parameters of the plant "four-wheel", see there.

    Raises
    ------
    ArgumentError
        If a name is unknown, a file cannot be used, or a number cannot be driven.
    """

    keeps_logs: ClassVar[bool] = True
    takes_parts: ClassVar[bool] = True

    track: str | FilePath = "club"
    vehicle: str | FilePath | None = None
    plant: str = "four-wheel"
    controller: str = "rti"
    grip: float = 0.9
    laps: int = 1
    estimator: str = "ekf"
    mu: float | None = None
    seed: int = 0
    width: float | None = None
    smoothing: float | None = None
    distance: float | None = None
    backend: str | None = None
    varied: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        known_names((self.controller,), "controller", CONTROLLERS)
        positive_number(self.grip, "grip")
        whole_number(self.laps, "laps", 1)
        whole_number(self.seed, "seed", 0, most=float("inf"))
        if self.mu is not None:
            positive_number(self.mu, "mu")
        if self.distance is not None:
            positive_number(self.distance, "distance")
        estimator_of(self.estimator, self.car)
        if self.laps > 1 and not self.road.path.closed:
            raise ArgumentError("laps", str(self.laps), f"1: {self.road.name} leads from one end to the other")
        _ = self.setting

    @property
    def car(self) -> VehicleParameters:
        """The vehicle, as it is predicted."""
        return self.driven_car.car

    @cached_property
    def driven_car(self) -> DrivenCar:
        """The plant."""
        return _driven_car(get_ident(), self.plant, self._vehicle(), self.varied)

    @property
    def _named(self) -> str | FilePath:
        return usual_vehicle(self.plant) if self.vehicle is None else self.vehicle

    def _vehicle(self) -> VehicleParameters:
        name = self._named
        if name in VEHICLES:
            return VEHICLES[str(name)]
        path = FilePath(name)
        if not (path.suffix or path.is_file()):
            raise UnknownNameError("vehicle", str(name), VEHICLES, "Or name a TOML file.")
        try:
            return VehicleParameters.from_toml(path)
        except OSError as error:
            raise ArgumentError("vehicle", f"'{path}' ({error.strerror})", "a TOML file that can be read") from None

    @cached_property
    def road(self) -> DrivenRoad:
        """What is driven on."""
        return driven_road(self.track, self.car, width=self.width, smoothing=self.smoothing)

    @cached_property
    def profile(self) -> SpeedProfile:
        """How fast, along the road's path."""
        return speed_profile(self.road.path, SpeedLimits.of_car(self.car, self.grip, mu=self.mu))

    @property
    def length(self) -> float:
        """Of the drive [m]."""
        whole = self.laps * self.road.path.length
        return whole if self.distance is None else min(self.distance, whole)

    @cached_property
    def setting(self) -> DriveSetting:
        """All that the scenario is made of."""
        noisy = self.estimator != EXACT
        return DriveSetting(
            self.road.path,
            self.profile,
            self.driven_car,
            PATIENCE * float(self.profile.time_at(self.length) - self.profile.time_at(0.0)) + MORE,
            track=self.road.track,
            controller=self.controller,
            backend=self.backend,
            estimator=estimator_of(self.estimator, self.car),
            noise=noise_of(self.car) if noisy else {},
            mu=self.mu,
            seed=self.seed,
        )

    @cached_property
    def drive(self) -> DriveRun:
        """The drive itself."""
        road = self.road
        return DriveRun(self.setting.scenario(), road.track, road.path, self.profile, 0.0, self.length, self.car)

    def runs(self) -> dict[Key, Run]:
        """The drive, by the controller's name."""
        return {(self.controller,): self.drive}

    def driven(self, log: xr.Dataset) -> Driven:
        """A log, and what else figures of merit need."""
        return self.drive.driven(log)

    def summary(self, results: Mapping[str, xr.Dataset]) -> dict[str, Any]:
        """What was driven, how it ended, and the figures of merit; `results` has the log by the controller's name."""
        log = results.get(self.controller)
        found = None if log is None else kpis(self.driven(log), KPIS)
        return {
            "study": "drive",
            "track": self.road.name,
            "vehicle": self.car_name,
            "plant": self.plant,
            "controller": self.controller,
            "estimator": self.estimator,
            "grip": self.grip,
            "mu": self.car.mu if self.mu is None else self.mu,
            "laps": self.laps,
            "seed": self.seed,
            "path_length_m": self.road.path.length,
            "sampling_time_s": SAMPLING_TIME,
            "outcome": None if log is None else log.attrs.get("outcome", BROKEN_OFF),
            "ended": None if log is None else log.attrs.get("ended", _broken_off(log, found)),
            "kpis": found,
        }

    @property
    def car_name(self) -> str:
        """The vehicle's, for readers."""
        return str(self._named) if self._named in VEHICLES else FilePath(self._named).stem

    def report(self, results: Mapping[str, xr.Dataset]) -> Report:
        """How the car drove, in tables and figures."""
        content = self.summary(results)
        log = results.get(self.controller)
        exact = self.estimator == EXACT
        lead = (
            f"{self.car_name} as {self.plant} on {self.road.name} ({self.road.path.length:,.0f} m) at a grip of "
            f"{self.grip:g}, driven by {self.controller} in wind, "
            f"{'its state known exactly' if exact else f'with noisy sensors and {self.estimator}'}; seed {self.seed}."
        )
        shown = [] if log is None else sections(content, self.driven(log), self.road, self.grip, self.mu)
        outcome = content["outcome"]
        warning = "" if outcome in (None, FINISHED, BROKEN_OFF) else str(content["ended"])
        return Report("A drive", lead, content, shown, warning)


@lru_cache(maxsize=16)
def _driven_car(thread: int, plant: str, car: VehicleParameters, varied: tuple[str, ...]) -> DrivenCar:
    """A plant, the same for all drives of a thread: threads must not share one."""
    return driven_car(plant, car, SAMPLING_TIME, varied)


def _broken_off(log: xr.Dataset, found: Mapping[str, Any] | None) -> str:
    distance = 0.0 if found is None else found[PLACE["distance"].key] or 0.0
    return f"Broken off after {distance:.0f} m and {float(log['time'].to_numpy().max(initial=0.0)):.2f} s."
