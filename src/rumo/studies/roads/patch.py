"""A plant on a road whose friction is another one at some place."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rumo.model import Parameter
from rumo.references import Path
from rumo.signals import Array
from rumo.simulation import Plant

PARTS = 5
"""Of a sample, at whose beginnings the friction is looked up: 0.3 m at 40 m/s."""


class Patch:
    """A car, and a part of a path on which its parameter mu has another value, whatever it is said to be.

    Parameters
    ----------
    plant : Plant
        With states p_x, p_y and a parameter mu.
    path : Path
        Along which the place of the car is measured.
    place : (float, float)
        Arc lengths where the patch begins and ends [m].
    mu : float
        Friction there.
    """

    def __init__(self, plant: Plant, path: Path, place: tuple[float, float], mu: float) -> None:
        self._plant, self._path, self._place, self._mu = plant, path, place, mu
        self.name, self.sampling_time = f"{plant.name} on a patch", plant.sampling_time
        self.states, self.inputs, self.outputs = plant.states, plant.inputs, plant.outputs
        units = zip(plant.parameters, plant.parameters.units, plant.default_parameters.tolist(), strict=True)
        self.parameters = {name: Parameter(unit, default) for name, unit, default in units}
        self._at = [plant.states.index(name, "plant") for name in ("p_x", "p_y")]
        self._friction = plant.parameters.index("mu", "plant")
        self._observer: Callable[[Array, Array, Array], Array] | None = None

    def reset(self) -> None:
        """Begin a run."""
        self._plant.reset()

    def advance(self, x: Array, u: Array, p: Array, duration: float | None = None) -> Array:
        """State (nx,) a sampling time later, or a duration [s], see `rumo.simulation.PlantLike`."""
        part = (self.sampling_time if duration is None else duration) / PARTS
        for _ in range(PARTS):
            x = self._plant.advance(x, u, self._there(x, p), part)
        return x

    def observe(self, x: Array, u: Array, p: Array) -> dict[str, float]:
        """Outputs at a state."""
        if self._observer is None:
            self._observer = self._plant.observer(self.outputs.names)
        return dict(zip(self.outputs, self._observer(x, u, self._there(x, p)).tolist(), strict=True))

    def _there(self, x: Array, p: Array) -> Array:
        """Parameters where the car is."""
        p_x, p_y = x[self._at].tolist()
        s = self._path.nearest(p_x, p_y, 0.0, self._path.length)
        if not self._place[0] <= s < self._place[1]:
            return p
        p = np.array(p)
        p[self._friction] = self._mu
        return p
