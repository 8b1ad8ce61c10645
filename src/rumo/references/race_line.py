"""The race line of least curvature within a track."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse

from rumo.checks import checked, non_negative_number, positive_number, whole_number
from rumo.errors import ArgumentError
from rumo.references.paths import Path
from rumo.references.tracks import Track
from rumo.signals import Array

CONVERGED = 1e-4
"""Change of the line that ends the iteration [m]."""
FOLD = 0.9
"""Share of the centre line's radius up to which a line may be on its inside: beyond it, it would run backwards."""


def minimum_curvature(track: Track, margin: float = 0.0, *, spacing: float = 2.0, max_iterations: int = 30) -> Path:
    """The path within a track whose squared curvature, integrated along it, is least.

    Parameters
    ----------
    track : Track
        Open or closed; a line along an open one begins and ends anywhere within its limits.
    margin : float
        How far it stays from both edges: half the width of the vehicle, and what it shall have to spare [m].
    spacing : float
        Of the points that are moved sideways, at most [m].
    max_iterations : int
        Of the quadratic programs, each about the line of the one before.

    Returns
    -------
    Path
        Through the points.

    Raises
    ------
    ArgumentError
        If the margins leave nothing of the track.

    Notes
    -----
    Gauss's and Newton's method: the curvature by differences of points p + alpha n is linearised in their distances
    alpha from the centre line, and alpha found by a quadratic program with bounds (PIQP, sparse).
    Source: Braghin et al. (2008), doi 10.1016/j.compstruc.2008.01.010; Heilmeier et al. (2020),
    doi 10.1080/00423114.2019.1631455, who linearise likewise.
    """
    checked(track, "track", Track)
    least, most = non_negative_number(margin, "margin"), whole_number(max_iterations, "max_iterations", 1)
    path = track.path
    n = max(int(np.ceil(path.length / positive_number(spacing, "spacing"))), 8)
    s = np.linspace(0.0, path.length, n + 1)[: n if path.closed else n + 1]
    lower, upper = room_aside(track, s, least)
    centre = path.at(s)
    p = np.stack([centre.x, centre.y])
    normal = np.stack([-np.sin(centre.heading), np.cos(centre.heading)])
    first, second = _differences(len(s), path.length / n, path.closed)
    alpha = np.zeros_like(s)
    for iteration in range(most):
        residual, jacobian = _curvature(p + alpha * normal, normal, first, second)
        step = _step(jacobian, residual, lower - alpha, upper - alpha)
        if iteration:
            step *= _share(alpha, step, float(residual @ residual), p, normal, first, second)
        alpha = alpha + step  # at first to within limits, whatever it costs: the centre line may be out of them
        if np.abs(step).max() < CONVERGED:
            break
    return Path((p + alpha * normal).T, path.closed)


def room_aside(track: Track, s: Array, margin: float) -> tuple[Array, Array]:
    """How far a line may be to the right, negative, and to the left of a track's path at arc lengths s (n,) [m].

    Within margins of the edges, and of where normals of the path would meet. Raises where nothing is left.
    """
    left, right = track.limits(s)
    kappa = track.path.at(s).curvature
    with np.errstate(divide="ignore"):
        inside = FOLD / np.abs(kappa)
    upper = np.minimum(left - margin, np.where(kappa > 0.0, inside, np.inf))
    lower = np.maximum(margin - right, np.where(kappa < 0.0, -inside, -np.inf))
    if not (lower < upper).all():
        i = int(np.argmin(upper - lower))
        got = f"{margin:g} m, which leaves {upper[i] - lower[i]:.3g} m at {s[i]:.4g} m"
        raise ArgumentError("margin", got, "less than half the track")
    return lower, upper


def _differences(n: int, h: float, closed: bool) -> tuple[Any, Any]:
    """Central first and second differences at spacing h, at the inner points of an open line."""
    i = np.arange(n) if closed else np.arange(1, n - 1)
    rows, ones = np.arange(len(i)), np.ones(len(i))
    before, after = (i - 1) % n, (i + 1) % n

    def matrix(*parts: tuple[float, Any]) -> Any:
        values = np.concatenate([value * ones for value, _ in parts])
        columns = np.concatenate([column for _, column in parts])
        return sparse.csr_matrix((values, (np.tile(rows, len(parts)), columns)), shape=(len(i), n))

    first = matrix((-0.5 / h, before), (0.5 / h, after))
    return first, matrix((1.0 / h**2, before), (-2.0 / h**2, i), (1.0 / h**2, after))


def _curvature(points: Array, normal: Array, first: Any, second: Any) -> tuple[Array, Any]:
    """What squared adds up to the integral of the squared curvature, kappa sqrt(|r'|), and its derivative by alpha."""
    dx, dy = first @ points[0], first @ points[1]
    ddx, ddy = second @ points[0], second @ points[1]
    g = dx**2 + dy**2
    residual = (dx * ddy - dy * ddx) / g**1.25
    nx, ny = sparse.diags(normal[0]), sparse.diags(normal[1])
    # d(residual) = (dx' y'' + x' dy'' - dy' x'' - y' dx'') / g^(5/4) - 5/2 residual (x' dx' + y' dy') / g
    scale, shrink = g**-1.25, 2.5 * residual / g
    by_x = sparse.diags(scale * ddy - shrink * dx) @ first - sparse.diags(scale * dy) @ second
    by_y = sparse.diags(scale * dx) @ second - sparse.diags(scale * ddx + shrink * dy) @ first
    return residual, (by_x @ nx + by_y @ ny).tocsc()


def _step(jacobian: Any, residual: Array, lower: Array, upper: Array) -> Array:
    """The step that the linearised problem asks for."""
    import piqp  # not needed by those who follow a centre line

    n = len(lower)
    solver: Any = piqp.SparseSolver()
    solver.settings.eps_abs = solver.settings.eps_rel = 1e-9
    hessian = sparse.csc_matrix(jacobian.T @ jacobian)
    weight = 1.0 / max(float(np.abs(hessian.diagonal()).max()), 1e-300)  # of order 1, whatever the track's size
    nothing: Any = sparse.csc_matrix((0, n))
    solver.setup(
        weight * hessian,
        weight * (jacobian.T @ residual),
        nothing,
        np.zeros(0),
        nothing,
        np.zeros(0),
        np.zeros(0),
        lower,
        upper,
    )
    solver.solve()
    return np.clip(solver.result.x, lower, upper)


def _share(alpha: Array, step: Array, cost: float, p: Array, normal: Array, first: Any, second: Any) -> float:
    """How much of a step makes the line better; 0 if none of it does."""
    for share in (1.0, 0.5, 0.25, 0.125, 0.0625):
        residual, _ = _curvature(p + (alpha + share * step) * normal, normal, first, second)
        if residual @ residual < cost:
            return share
    return 0.0
