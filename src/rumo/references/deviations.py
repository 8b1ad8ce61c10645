"""How far a vehicle is from its path, in the path's frame."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import as_numbers, checked
from rumo.errors import ArgumentError, ShapeError
from rumo.references.paths import Path
from rumo.references.speed_profile import SpeedProfile
from rumo.signals import Array, NamedArray


def deviations(
    path: Path,
    x: Mapping[str, ArrayLike] | NamedArray[Any],
    profile: SpeedProfile | None = None,
    *,
    near: float | None = None,
    window: float = 10.0,
) -> dict[str, Array]:
    """Where a vehicle is along a path, and how far from it, by the names that Autoware uses.

    Parameters
    ----------
    path : Path
        That was to be followed.
    x : mapping of str to array_like, or NamedArray
        At least p_x and p_y [m], one value each or (n,) of a drive in order; psi [rad], v_x and v_y [m/s] if there.
    profile : SpeedProfile, optional
        The speeds that were wanted.
    near : float, optional
        Arc length near which the vehicle is at first [m]; where it is nearest of all if not given.
    window : float
        How far from one place to the next to look, forwards and backwards [m].

    Returns
    -------
    dict of str to ndarray
        progress [m], counted on from lap to lap, and lap; lateral_deviation, to the left [m]; with psi, yaw_deviation
        from the tangent, within half a turn [rad]; with v_x, course_deviation, the same of the direction of motion
        [rad], NaN at rest; and speed_deviation with a profile [m/s]. NaN where the position is.

    Raises
    ------
    ArgumentError
        If there is no position, or what is there differs in shape.
    """
    checked(path, "path", Path)
    given = x.as_dict() if isinstance(x, NamedArray) else x
    for name in ("p_x", "p_y"):
        if name not in given:
            raise ArgumentError("x", f"no {name}", "at least p_x and p_y")
    values = {
        name: as_numbers(given[name], f"x[{name!r}]") for name in ("p_x", "p_y", "psi", "v_x", "v_y") if name in given
    }
    shape = values["p_x"].shape
    for name, array in values.items():
        if array.shape != shape or array.ndim > 1:
            raise ShapeError(f"x[{name!r}]", f"shape {array.shape}", f"shape {shape} of p_x, one value or (n,)")
    progress = np.reshape(_progress(path, np.ravel(values["p_x"]), np.ravel(values["p_y"]), near, window), shape)
    there = path.at(progress)
    found = {
        "progress": progress,
        "lap": np.floor(progress / path.length) if path.closed else np.zeros(shape),
        "lateral_deviation": there.left(values["p_x"], values["p_y"]),
    }
    if "psi" in values:
        found["yaw_deviation"] = there.turned(values["psi"])
    if "v_x" in values and "psi" in values:
        v_y = values.get("v_y", np.zeros(shape))
        speed = np.hypot(values["v_x"], v_y)
        course = values["psi"] + np.arctan2(v_y, values["v_x"])
        found["course_deviation"] = np.where(speed > 0.0, there.turned(course), np.nan)
        if profile is not None:
            found["speed_deviation"] = speed - profile.speed_at(progress)
    return found


def _progress(path: Path, x: Array, y: Array, near: float | None, window: float) -> Array:
    progress, last = np.full(len(x), np.nan), near
    for i, place in enumerate(np.column_stack([x, y])):
        progress[i] = path.project(place, last, window=window)
        last = progress[i] if np.isfinite(progress[i]) else last
    return progress
