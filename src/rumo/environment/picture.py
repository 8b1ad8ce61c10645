"""A car on its track, from above."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rumo.references import Track

LENGTHS = 8.0
"""Of the car, from it to the upper edge of the picture."""


def picture(
    track: Track,
    s: float,
    trail: Sequence[tuple[float, float]],
    pose: tuple[float, float, float],
    size: tuple[float, float],
) -> NDArray[np.uint8]:
    """Pixels (400, 600, 3) of the surroundings of a car.

    Parameters
    ----------
    track : Track
        That it is on.
    s : float
        Arc length near which it is [m].
    trail : sequence of tuple of float
        Positions where it has been [m].
    pose : tuple of float
        Position and heading [m, m, rad].
    size : tuple of float
        Length and width [m].
    """
    x, y, psi = pose
    length, width = size
    reach = LENGTHS * length
    figure = Figure(figsize=(6.0, 4.0), dpi=100, facecolor="#e8ece4")
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(x - 1.5 * reach, x + 1.5 * reach)
    axes.set_ylim(y - reach, y + reach)
    places = s + np.linspace(-3.0 * reach, 3.0 * reach, 241)
    left, right = track.edges(places)
    road = np.vstack([left, right[::-1]])
    axes.fill(road[:, 0], road[:, 1], color="#c9c9c9")
    for edge in (left, right):
        axes.plot(edge[:, 0], edge[:, 1], color="white", linewidth=2.0)
    middle = track.path.at(places)
    axes.plot(middle.x, middle.y, color="white", linewidth=1.0, linestyle=(0, (6, 6)))
    if trail:
        been = np.array(trail)
        axes.plot(been[:, 0], been[:, 1], color="#1f77b4", linewidth=1.5)
    corners = 0.5 * np.array([[length, width], [length, -width], [-length, -width], [-length, width]])
    turned = corners @ np.array([[np.cos(psi), np.sin(psi)], [-np.sin(psi), np.cos(psi)]])
    axes.fill(x + turned[:, 0], y + turned[:, 1], color="#b22222")
    nose = np.array([0.5 * length, 0.15 * length]) * np.array([[np.cos(psi)], [np.sin(psi)]])
    axes.plot(x + nose[0], y + nose[1], color="white", linewidth=1.5)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()
