"""What is driven on: tracks and manoeuvres by name, and tracks from files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path as FilePath

from rumo.errors import ArgumentError, UnknownNameError
from rumo.references import TRACKS, Path, Track, load_track
from rumo.references.manoeuvres import iso_3888_1, iso_3888_2
from rumo.signals import Array
from rumo.vehicles import VehicleParameters

MANOEUVRES = {"iso-3888-1": iso_3888_1, "iso-3888-2": iso_3888_2}
ROADS = (*TRACKS, *MANOEUVRES)
"""Names."""
MARGIN = 0.1
"""Between the sides of a car and the cones that its path leads past [m]."""


@dataclass(frozen=True, eq=False)
class DrivenRoad:
    """A path, and the ground around it.

    Attributes
    ----------
    track : Track
        Where the car is to stay.
    path : Path
        What it follows.
    cones : ndarray, shape (n, 2), or None
        Positions of cones [m].
    """

    track: Track
    path: Path
    cones: Array | None = None

    @property
    def name(self) -> str:
        """For readers."""
        return self.track.name


def driven_road(
    name: str | FilePath, car: VehicleParameters, *, width: float | None = None, smoothing: float | None = None
) -> DrivenRoad:
    """A road by name, or from a file.

    Parameters
    ----------
    name : str or Path
        One of `ROADS`, or a file as `load_track` reads it.
    car : VehicleParameters
        The lanes of a manoeuvre are as wide as it takes.
    width, smoothing : float, optional
        Of a file, see `load_track` [m].

    Raises
    ------
    UnknownNameError
        If there is neither a road nor a file of that name.
    FileError
        If the file holds no track.
    """
    road, path = str(name), FilePath(name)
    if road not in ROADS:
        if path.is_file():
            return _from_file(path, width, smoothing)
        if path.suffix or path.is_dir():
            what = "which is a folder" if path.is_dir() else "which is not there"
            raise ArgumentError("track", f"{road!r}, {what}", f"a file, or one of {', '.join(ROADS)}")
        raise UnknownNameError("track", road, ROADS, "Or name a file.")
    for argument, value in (("width", width), ("smoothing", smoothing)):
        if value is not None:
            raise ArgumentError(argument, repr(value), f"nothing: {road} is no file")
    if road in TRACKS:
        track = TRACKS[road]()
        return DrivenRoad(track, track.path)
    change = MANOEUVRES[road](car.width)
    return DrivenRoad(change.track(), change.path(MARGIN), change.cones())


def _from_file(path: FilePath, width: float | None, smoothing: float | None) -> DrivenRoad:
    try:
        track = load_track(path, width=width, smoothing=smoothing)
    except OSError as error:
        raise ArgumentError("track", f"'{path}' ({error.strerror})", "a file that can be read") from None
    return DrivenRoad(track, track.path)
