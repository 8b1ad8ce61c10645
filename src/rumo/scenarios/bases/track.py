"""A car on a track, as `rumo drive` drives it."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from threading import get_ident
from typing import Annotated, Any

from rumo.errors import ArgumentError
from rumo.scenarios.arguments import Argument
from rumo.scenarios.parts import plant_signals
from rumo.simulation import ByPlace, Constant
from rumo.studies.drive import ESTIMATORS, Drive, DriveRun
from rumo.vehicles.varied import OF_ALL_CARS


def track(
    *,
    track: Annotated[
        str, Argument("1", "A name such as club, oval, eight, iso-3888-1, or a file.", file=True)
    ] = "club",
    vehicle: Annotated[
        str | None, Argument("1", "A name such as passenger or racer, or a TOML file; the plant's own.", file=True)
    ] = None,
    plant: Annotated[str, Argument("1", "A name such as four-wheel, bicycle or commonroad-mb:2.")] = "four-wheel",
    grip: Annotated[float, Argument("1", "Share of friction that the speed profile uses.", above=0.0)] = 0.9,
    mu: Annotated[
        float | None, Argument("1", "Friction of the road, known to all; the car's own if none.", above=0.0)
    ] = None,
    estimator: Annotated[str, Argument("1", "From noisy measurements to a state.", choices=ESTIMATORS)] = "ekf",
    laps: Annotated[int, Argument("1", "To be driven; 1 on an open path.", least=1)] = 1,
    distance: Annotated[float | None, Argument("m", "To be driven, if not all laps.", above=0.0)] = None,
    width: Annotated[float | None, Argument("m", "Of a track from a file that has none.", above=0.0)] = None,
    smoothing: Annotated[float | None, Argument("m", "How far the path may pass a file's points.", least=0.0)] = None,
    patch_at: Annotated[
        float, Argument("m", "Along the path, where a patch of other friction begins.", least=0.0)
    ] = 0.0,
    patch_length: Annotated[float, Argument("m", "Of the patch; nothing for none.", least=0.0)] = 0.0,
    patch_friction: Annotated[
        float, Argument("1", "Of the road there, of which only the plant knows.", above=0.0)
    ] = 0.3,
) -> DriveRun:
    """A car laps a track at a share of its grip, in wind and with noisy sensors, until it arrives or is lost.

    Friction that only the plant knows of is `plant.mu`; a four-wheel plant also has the numbers of
    `rumo.vehicles.varied.OF_ALL_CARS` as parameters.
    """
    settings: dict[str, Any] = {
        "track": track,
        "vehicle": vehicle,
        "plant": plant,
        "grip": grip,
        "mu": mu,
        "estimator": estimator,
        "laps": laps,
        "distance": distance,
        "width": width,
        "smoothing": smoothing,
    }
    drive = _drive(get_ident(), tuple(_changed(name) for name in (track, vehicle)), tuple(settings.items()))
    return _patched(drive, patch_at, patch_length, patch_friction) if patch_length else drive


def _patched(drive: DriveRun, at: float, length: float, friction: float) -> DriveRun:
    """The same drive over a patch of other friction, once in each lap."""
    scenario, path = drive.scenario, drive.path
    own = plant_signals(scenario).parameters.get("mu")
    if own is None:
        raise ArgumentError("patch_length", f"{length:g}", "0: this plant has no friction that could be changed")
    known = scenario.disturbances.get("mu")
    own = known.value if isinstance(known, Constant) else own
    if at >= path.length or length > path.length:
        name, value = ("patch_at", at) if at >= path.length else ("patch_length", length)
        raise ArgumentError(name, f"{value:g}", f"a place on the path, which is {path.length:.0f} m long")
    end = at + length
    values = {0.0: own, at: friction, end: own}
    if path.closed and end > path.length:  # across the line
        values = {0.0: friction, end - path.length: own, at: friction}
    ice = ByPlace(path, values)
    return replace(drive, scenario=replace(scenario, disturbances={**scenario.disturbances, "mu": ice}))


def _changed(name: str | None) -> tuple[int, int] | None:
    """When a file was changed, and its size; nothing of what is no file."""
    if name is None or not Path(name).is_file():
        return None
    status = Path(name).stat()
    return status.st_mtime_ns, status.st_size


@lru_cache(maxsize=32)
def _drive(thread: int, files: tuple[object, ...], settings: tuple[tuple[str, Any], ...]) -> DriveRun:
    return Drive(**dict(settings), varied=OF_ALL_CARS).drive
