"""What controllers look like where each run is a point."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rumo.report.charts import Look
from rumo.signals import Array
from rumo.studies.looks import LOOKS, look

COLORS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#D55E00", "#56B4E9")
MARKERS = ("circle", "diamond", "square", "triangle-up", "x", "star")


def line_looks(controllers: tuple[str, ...]) -> dict[str, Look]:
    """Lines of controllers: as in all studies, and told apart where they are others."""
    found: dict[str, Look] = {}
    for i, name in enumerate(controllers):
        other = Look(COLORS[i % len(COLORS)], ("solid", "dash", "dot", "dashdot")[i % 4], 2.0)
        found[name] = replace(look(name), width=1.8) if name in LOOKS else other
    return found


def point_looks(controllers: tuple[str, ...], size: float = 3.4) -> dict[str, Look]:
    """Points of controllers, in the colours of their lines."""
    return {
        name: replace(line, dash="", marker=MARKERS[i % len(MARKERS)], size=size)
        for i, (name, line) in enumerate(line_looks(controllers).items())
    }


def slim(values: Array) -> Array:
    """Values as a figure has them, in half the size on a page."""
    return np.asarray(values, dtype=np.float32)
