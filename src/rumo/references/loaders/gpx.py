"""Tracks recorded by satellite navigation: GPX files, in metres about their middle."""

from __future__ import annotations

from pathlib import Path as FilePath
from xml.parsers import expat

import numpy as np

from rumo.errors import FileError
from rumo.references.loaders.delimited import Table
from rumo.signals import Array

SEMI_MAJOR, FLATTENING = 6_378_137.0, 1.0 / 298.257223563
"""Of the ellipsoid WGS 84 [m]."""
POINTS = ("trkpt", "rtept", "wpt")
"""Of tracks, else of routes, else single ones."""


def read_gpx(file: str | FilePath) -> Table:
    """Points of a GPX file, x to the east and y to the north of their middle [m].

    Raises
    ------
    FileError
        If it is no XML, has no points, or a point is nowhere on earth.
    """
    found: dict[str, list[tuple[int, float, float]]] = {kind: [] for kind in POINTS}
    parser = expat.ParserCreate()

    def begin(tag: str, attributes: dict[str, str]) -> None:
        kind = tag.rsplit(":", 1)[-1]
        if kind in found:
            line = parser.CurrentLineNumber
            place = [_degrees(file, line, attributes, name, most) for name, most in (("lat", 90.0), ("lon", 180.0))]
            found[kind].append((line, place[0], place[1]))

    parser.StartElementHandler = begin
    try:
        parser.Parse(FilePath(file).read_bytes(), True)
    except expat.ExpatError as error:
        raise FileError(file, error.lineno, expat.errors.messages[error.code], "well-formed XML, as GPX is") from None
    except (ValueError, LookupError) as error:  # an encoding that nobody knows
        if isinstance(error, FileError):
            raise
        raise FileError(file, parser.CurrentLineNumber, str(error), "XML in UTF-8") from None
    points = next((points for points in found.values() if points), None)
    if points is None:
        raise FileError(file, None, "no points", f"some of {', '.join(POINTS)} with lat and lon")
    lines, latitude, longitude = zip(*points, strict=True)
    x, y = local(np.array(latitude), np.array(longitude))
    return Table(str(file), {"x": x, "y": y}, list(lines))


def local(latitude: Array, longitude: Array) -> tuple[Array, Array]:
    """Metres to the east and to the north of the middle of places (n,) [deg], by the ellipsoid's radii there.

    A place 5 km away is told to 2 m or so at 50 degrees, and the shape of a track of a few kilometres to 0.1 %.
    """
    middle = 0.5 * (latitude.min() + latitude.max())
    east = (longitude - longitude[0] + 180.0) % 360.0 - 180.0
    east -= 0.5 * (east.min() + east.max())
    e2 = FLATTENING * (2.0 - FLATTENING)
    w2 = 1.0 - e2 * np.sin(np.deg2rad(middle)) ** 2
    across, along = SEMI_MAJOR / np.sqrt(w2), SEMI_MAJOR * (1.0 - e2) / w2**1.5
    x = np.deg2rad(east) * across * np.cos(np.deg2rad(middle))
    return x, np.deg2rad(latitude - middle) * along


def _degrees(file: object, line: int, attributes: dict[str, str], name: str, most: float) -> float:
    text = attributes.get(name)
    if text is None:
        raise FileError(file, line, f"a point without {name}", "lat and lon")
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not abs(value) <= most:
        raise FileError(file, line, f"{name}={text!r}", f"degrees from {-most:g} to {most:g}")
    return value
