"""What the controller is told of the sensors behind its states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rumo.checks import as_numbers, checked_items, non_negative_number, whole_number
from rumo.errors import ArgumentError
from rumo.signals import Array, read_only
from rumo.structure import Structure
from rumo.turns import unturned

TURN = 2.0 * np.pi


@dataclass(frozen=True)
class Measurement:
    """What is known of the measurement of a state; what is not given is not known.

    Parameters
    ----------
    noise : float
        Standard deviation, in the state's unit.
    resolution : float
        Smallest difference that it shows, in the state's unit: a reading that stays is no surprise while the state
        moves by less.
    range : (float, float)
        Smallest and largest reading that there is; one outside is none.
    angle : bool, optional
        Whether a full turn is no difference. Found in the model if not given: a state in rad is an angle if
        equations, constraints and tracked outputs stay as they are when it grows by 2 pi, but for a tracked output
        that is the state itself.
    age : int
        Samples since it was read when it comes, at most the horizon, and the same for each reading. An old reading is
        brought to now by how far the plans have gone since, and by what its innovation means for all states at each
        sample in between, as linearised; before there are so many plans, by those there are. The model is believed for
        as long: what it does not know of is seen so much later, and where it is unstable noise grows with the age.
    """

    noise: float = 0.0
    resolution: float = 0.0
    range: tuple[float, float] = (-np.inf, np.inf)
    angle: bool | None = None
    age: int = 0

    def __post_init__(self) -> None:
        for name in ("noise", "resolution"):
            value = non_negative_number(getattr(self, name), f"Measurement.{name}")
            if value == np.inf:
                raise ArgumentError(f"Measurement.{name}", "inf", "a finite number", "Leave it out if it is not known.")
        limits = as_numbers(self.range, "Measurement.range")
        if limits.shape != (2,) or not limits[0] < limits[1]:
            raise ArgumentError("Measurement.range", repr(self.range), "two limits, the lower one first")
        object.__setattr__(self, "range", (float(limits[0]), float(limits[1])))
        if self.angle is not None and not isinstance(self.angle, bool):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise ArgumentError("Measurement.angle", repr(self.angle), "True, False, or None to find out")
        whole_number(self.age, "Measurement.age", 0)


@dataclass(frozen=True, eq=False)
class SensorNumbers:
    """The same as the core has it.

    Attributes
    ----------
    turn : ndarray, shape (nx,)
        2 pi for angles, else 0.
    noise, resolution : ndarray, shape (nx,)
        0 where not known.
    lowest, highest : ndarray, shape (nx,)
        Readings that there are.
    age : ndarray of int, shape (nx,)
        Samples since they were read.
    output_states : ndarray of int, shape (ny,)
        The angle that a tracked output is, -1 for others.
    """

    turn: Array
    noise: Array
    resolution: Array
    lowest: Array
    highest: Array
    age: np.ndarray
    output_states: np.ndarray

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """Those that have a number for each state, by name."""
        return {name: array for name, array in vars(self).items() if name != "output_states"}


def sensor_numbers(structure: Structure, measurements: Mapping[str, Measurement] | None) -> SensorNumbers:
    """What a problem's `measurements`, checked here, say of each state of its model."""
    states = structure.model.states
    given = checked_items(measurements, "measurements", Measurement, "rumo.Measurement(noise=...)")
    horizon = len(structure.shares)
    for name, measurement in given.items():
        states.index(name, "measurements")
        if measurement.age > horizon:
            argument, cure = f"measurements[{name!r}].age", "What is older than all predictions says nothing of now."
            raise ArgumentError(argument, str(measurement.age), f"at most the horizon of {horizon}", cure)
    each = [given.get(name, Measurement()) for name in states]
    found = _angles(structure, [states.index(name) for name in states if given.get(name, Measurement()).angle is None])
    angles = np.array([found[i] if m.angle is None else m.angle for i, m in enumerate(each)])
    places = [states.index(name) if name in states else -1 for name in structure.outputs]
    return SensorNumbers(
        turn=read_only(np.where(angles, TURN, 0.0)),
        noise=read_only([m.noise for m in each]),
        resolution=read_only([m.resolution for m in each]),
        lowest=read_only([m.range[0] for m in each]),
        highest=read_only([m.range[1] for m in each]),
        age=np.array([m.age for m in each], dtype=np.int32),
        output_states=np.array([i if i >= 0 and angles[i] else -1 for i in places], dtype=np.int32),
    )


def _angles(structure: Structure, asked: Sequence[int]) -> list[bool]:
    """Which of the states asked for are in rad and used through functions of period 2 pi alone."""
    model, found = structure.model, [False] * len(structure.model.states)
    asked = [i for i in asked if model.states.units[i] == "rad"]
    if asked:
        own = set(model.states)
        others = [row for name, row in zip(structure.outputs, structure.output_rows, strict=True) if name not in own]
        functions = model.f, model.g, model.packed([*others, *(row.expression for row in structure.rows)])
        for i in asked:
            found[i] = all(unturned(function, 0, i) for function in functions)
    return found
