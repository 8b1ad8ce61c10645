"""Tracks and race lines from files: TUM's race tracks, F1TENTH's race lines, GPX, CSV, CommonRoad."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path as FilePath

import numpy as np

from rumo.checks import non_negative_number, positive_number
from rumo.errors import ArgumentError, FileError
from rumo.references.loaders.commonroad import read_commonroad
from rumo.references.loaders.delimited import Table, read_table
from rumo.references.loaders.gpx import read_gpx
from rumo.references.paths import Path
from rumo.references.speed_profile import SpeedProfile
from rumo.references.tracks import Track
from rumo.signals import Array

SMOOTHING = 0.01
"""Of loaded centre lines, as a share of the distance between points: 5 cm for points 5 m apart.

On the tracks of the TUM's database this takes away the spikes of the curvature's rate (its largest 0.022 to 0.016 on
Catalunya, 0.031 to 0.018 on Spielberg), moves no line by more than 0.3 m, and costs no bend its radius.
"""
JUMP, BACK = 25.0, np.deg2rad(150.0)
"""Distance between two points as a multiple of the usual, and change of direction, that no track has."""
CLOSED, SHORT = 3.0, 0.2
"""Distance from the last point to the first up to which a track is taken to be closed: as a multiple of the usual, and
as a share of its length."""


def load_track(
    file: str | FilePath,
    *,
    width: float | None = None,
    closed: bool | None = None,
    smoothing: float | None = None,
    lanelets: Sequence[int] | None = None,
) -> Track:
    """A track from a file, whose format follows from suffix and header.

    Parameters
    ----------
    file : str or Path
        `.gpx`: points of satellite navigation, in metres about their middle. `.xml`: a scenario of CommonRoad, whose
        lanelets are followed. Anything else: a table, with columns for x and y and, if there are, for widths to the
        left and to the right, named as in TUM's race tracks (`# x_m,y_m,w_tr_right_m,w_tr_left_m`), in F1TENTH's race
        lines (`# s_m; x_m; y_m; ...`), or plainly (`x,y,width_left,width_right`), in any order.
    width : float, optional
        Of the whole track, half of it to either side, where the file does not say [m].
    closed : bool, optional
        Whether it leads from its last point to its first; if these are close together, if not given.
    smoothing : float, optional
        See `Path`; a hundredth of the usual distance of points if not given [m]. What GPS recorded needs more, 0.3 to 1
        m. Widths are those from the smoothed line to the edges in the file.
    lanelets : sequence of int, optional
        Of a CommonRoad scenario, in the order of travel; the longest way through it if not given.

    Raises
    ------
    FileError
        If the file does not hold a track, naming the line.
    ArgumentError
        If another argument cannot work.
    OSError
        If it cannot be read.

    Notes
    -----
    Formats: TUMFTM/racetrack-database, f1tenth/f1tenth_racetracks, topografix.com/GPX/1/1, commonroad.in.tum.de.
    """
    suffix = FilePath(file).suffix.lower()
    if suffix == ".xml":
        table = read_commonroad(file, lanelets)
    elif lanelets is not None:
        raise ArgumentError("lanelets", repr(lanelets), f"nothing: {file} is no CommonRoad scenario (.xml)")
    else:
        table = read_gpx(file) if suffix == ".gpx" else read_table(file)
    table, ring = _checked(table, closed)
    points = np.column_stack([table.columns["x"], table.columns["y"]])
    usual = float(np.median(_gaps(points)))
    path = _path(
        table, points, ring, SMOOTHING * usual if smoothing is None else non_negative_number(smoothing, "smoothing")
    )
    # The points lie beside the smoothed path; the edges stay where they are.
    there = path.at(path.stations)
    aside = np.cos(there.heading) * (points[:, 1] - there.y) - np.sin(there.heading) * (points[:, 0] - there.x)
    left, right = _widths(table, width)
    try:
        return Track(path, left + aside, right - aside, FilePath(file).stem)
    except ArgumentError as error:
        raise FileError(table.file, None, str(error), "a track", "Less smoothing=... may help.") from None


def load_race_line(
    file: str | FilePath, *, closed: bool | None = None, smoothing: float = 0.0
) -> tuple[Path, SpeedProfile]:
    """A line and the speeds along it, from a table with columns for x, y and speed, such as F1TENTH's race lines.

    Parameters
    ----------
    file, closed, smoothing
        See `load_track`.

    Returns
    -------
    path : Path
        Through the points.
    profile : SpeedProfile
        Speeds at the points, with constant accelerations between.

    Raises
    ------
    FileError
        If the file does not hold a race line, naming the line.
    OSError
        If it cannot be read.
    """
    table, ring = _checked(read_table(file), closed)
    if "speed" not in table.columns:
        raise FileError(table.file, None, "no column for the speed", "one such as vx_mps", "load_track needs none.")
    path = _path(table, np.column_stack([table.columns["x"], table.columns["y"]]), ring, smoothing)
    s, v = path.stations, table.columns["speed"]
    if ring:
        s, v = np.r_[s, path.length], np.r_[v, v[0]]
    try:
        return path, SpeedProfile(s, v, ring)
    except ArgumentError as error:
        raise FileError(table.file, None, str(error), "speeds that lead along the line") from None


def _checked(table: Table, closed: bool | None) -> tuple[Table, bool]:
    """A table of points that a line can go through, without the first at the end again, and whether it is closed."""
    points = np.column_stack([table.columns["x"], table.columns["y"]])
    if len(points) < 3:
        raise FileError(table.file, None, f"{len(points)} points", "at least three")
    gaps = _gaps(points)
    usual = float(np.median(gaps))
    for row in np.flatnonzero(gaps <= 1e-9 * usual)[:1] + 1:
        raise table.error(int(row), "the point before again", "another point", "Leave one of them out.")
    for row in np.flatnonzero(gaps > JUMP * usual)[:1] + 1:
        got = f"a point {gaps[row - 1]:.4g} m from the one before"
        raise table.error(int(row), got, f"points some {usual:.3g} m apart, in the order of travel")
    ends = float(np.linalg.norm(points[-1] - points[0]))
    ring = ends <= min(CLOSED * usual, SHORT * float(gaps.sum())) if closed is None else closed
    if ring and ends < 0.01 * usual:
        table = Table(table.file, {use: values[:-1] for use, values in table.columns.items()}, table.lines[:-1])
        points = points[:-1]
        if len(points) < 3:
            raise FileError(table.file, None, f"{len(points)} points", "at least three of a closed line")
    every = np.vstack([points[-1:], points, points[:1]]) if ring else points
    legs = np.diff(every, axis=0)
    turns = np.abs(np.angle(np.exp(1j * np.diff(np.arctan2(legs[:, 1], legs[:, 0])))))
    for row in np.flatnonzero(turns > BACK)[:1] + (0 if ring else 1):
        got = f"a point at which the line turns by {np.rad2deg(turns.max()):.0f} degrees"
        raise table.error(int(row), got, "points in the order of travel")
    return table, ring


def _path(table: Table, points: Array, closed: bool, smoothing: float) -> Path:
    try:
        return Path(points, closed, smoothing=smoothing)
    except ArgumentError as error:
        raise FileError(table.file, None, str(error), "points that a smooth line leads through") from None


def _widths(table: Table, width: float | None) -> tuple[Array, Array]:
    """Widths to the left and to the right (n,), as the file or else the caller says."""
    given = [side for side in ("left", "right") if side in table.columns]
    if len(given) == 1:
        raise FileError(table.file, None, f"a width to the {given[0]} alone", "widths to both sides")
    if given:
        for side in given:
            for row in np.flatnonzero(table.columns[side] <= 0.0)[:1]:
                got = f"a width of {table.columns[side][row]:g} m to the {side}"
                raise table.error(int(row), got, "a positive width")
        return table.columns["left"], table.columns["right"]
    if width is None:
        cure = "Say how wide the track is: load_track(file, width=10.0)."
        raise FileError(table.file, None, "no widths", "columns such as w_tr_left_m and w_tr_right_m", cure)
    half = np.full(len(table.lines), 0.5 * positive_number(width, "width"))
    return half, half


def _gaps(points: Array) -> Array:
    return np.linalg.norm(np.diff(points, axis=0), axis=1)
