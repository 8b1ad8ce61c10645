"""A car on a track: the environment `rumo/Drive-v0`."""

from __future__ import annotations

from rumo.environment.driving import DrivingEnvironment
from rumo.references import TRACKS, PathTracking, SpeedLimits, speed_profile
from rumo.simulation import Scenario
from rumo.vehicles import PASSENGER_CAR, Acceleration, four_wheel, path_problem, rolling_bicycle


def drive_club(
    track: str = "club", *, grip: float = 0.8, duration: float = 120.0, render_mode: str | None = None
) -> DrivingEnvironment:
    """The passenger car on a track that needs no file.

    The plant is the four-wheel car with load transfer, told accelerations and steering rates. Everything is measured
    exactly.

    Parameters
    ----------
    track : str
        Name in `rumo.references.TRACKS`.
    grip : float
        Share of friction that the profile's speeds use.
    duration : float
        Of an episode [s].
    render_mode : str, optional
        See `DrivingEnvironment`.
    """
    road, car, drive = TRACKS[track](), PASSENGER_CAR, Acceleration()
    profile = speed_profile(road.path, SpeedLimits.of_car(car, grip=grip))
    plant = four_wheel(car, load_transfer=True, drive=drive)
    here, speed = road.path.at(0.0), float(profile.speed_at(0.0))
    motion = {"p_x": float(here.x), "p_y": float(here.y), "psi": float(here.heading), "v_x": speed}
    wheels = {name: speed / car.r for name in plant.states if name.startswith("w_")}
    scenario = Scenario(
        path_problem(car, drive=drive),
        plant,
        dict.fromkeys(plant.states, 0.0) | motion | wheels,
        PathTracking(road.path, profile),
        duration,
        backend="portable",  # nobody who learns waits for a compiler
        observed=rolling_bicycle(car, drive=drive),
    )
    return DrivingEnvironment(scenario, road, size=(car.length, car.width), render_mode=render_mode)
