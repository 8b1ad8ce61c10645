"""Curves by their curvature, linear between stations: straights, arcs, and clothoids between them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import as_numbers
from rumo.errors import ArgumentError, ShapeError
from rumo.references.pieces import Nodes
from rumo.signals import Array

LONGEST, WIDEST = 1.0, 0.1
"""Piece of a curve that is one polynomial: at most so long [m], turning by so much [rad]."""
NODES, SHARES = np.polynomial.legendre.leggauss(4)


def clothoids(stations: Array, curvature: Array, pose: tuple[float, float, float]) -> Nodes:
    """Nodes of the curve with a curvature linear between stations, (n,) both, from a pose [m, m, rad] on."""
    lengths, largest = np.diff(stations), np.maximum(np.abs(curvature[:-1]), np.abs(curvature[1:]))
    counts = np.ceil(lengths * np.maximum(1.0 / LONGEST, largest / WIDEST)).astype(int)
    starts = [np.linspace(a, b, n, False) for a, b, n in zip(stations[:-1], stations[1:], counts, strict=True)]
    s = np.concatenate([*starts, stations[-1:]])
    h, kappa = np.diff(s), np.interp(s, stations, curvature)
    rate = np.repeat(np.diff(curvature) / lengths, counts)
    heading = pose[2] + np.r_[0.0, np.cumsum(0.5 * h * (kappa[:-1] + kappa[1:]))]
    # How far each piece leads: Gauss's quadrature, to 1e-12 of its length.
    d = 0.5 * np.multiply.outer(1.0 + NODES, h)
    psi = heading[:-1] + d * (kappa[:-1] + 0.5 * d * rate)
    x, y = (
        start + np.r_[0.0, np.cumsum(SHARES @ part(psi) * (0.5 * h))]
        for start, part in ((pose[0], np.cos), (pose[1], np.sin))
    )
    return Nodes(s, x, y, heading, kappa, np.stack([rate, rate]))


def checked_curvature(stations: ArrayLike, curvature: ArrayLike) -> tuple[Array, Array]:
    """Arc lengths, increasing, and the curvature there, (n,) both."""
    s = as_numbers(stations, "stations")
    if s.ndim != 1 or len(s) < 2 or not np.isfinite(s).all() or not (np.diff(s) > 0.0).all():
        raise ArgumentError("stations", repr(stations), "at least two arc lengths [m], increasing")
    kappa = as_numbers(curvature, "curvature")
    check_at_stations(kappa, s, "curvature")
    if not np.isfinite(kappa).all():
        raise ArgumentError("curvature", repr(curvature), "finite numbers [1/m]")
    return s, kappa


def check_at_stations(values: Array, stations: Array, name: str) -> None:
    """Raise unless there is one value at each station."""
    if values.shape != stations.shape:
        raise ShapeError(name, f"shape {values.shape}", f"shape {stations.shape}, one at each station")
