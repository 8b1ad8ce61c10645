"""The plant from sample to sample, and what faults put in its place."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from rumo.errors import ArgumentError
from rumo.signals import Array, read_only
from rumo.simulation.actuated import Piece
from rumo.simulation.faults import Fault
from rumo.simulation.foreign import ForeignPlant, as_plant
from rumo.simulation.plant import Plant
from rumo.simulation.sensors import RunningSensors


class DrivenPlant:
    """A plant with all that may be driven in its place.

    Parameters
    ----------
    plant : Plant or ForeignPlant
        As it is without faults.
    faults : sequence of Fault
        Of the run.
    disturbed : collection of str
        Parameters of the plant that vary with time.
    columns : list of int
        Which inputs of the plant the controller has; further ones stay as they are.
    parts : bool
        Whether it has to go on by parts of a sample.

    Raises
    ------
    ArgumentError
        If a fault's plant has other signals, or the plant does not go on by parts.
    """

    def __init__(
        self,
        plant: Plant | ForeignPlant,
        faults: Sequence[Fault],
        disturbed: Collection[str],
        columns: list[int],
        parts: bool,
    ) -> None:
        dt = plant.sampling_time
        self._plant, self._dt = plant, dt
        self._substitutes = [(fault.samples(dt), _substitute(fault, plant)) for fault in faults]
        self._columns = columns
        self._named = np.isin(plant.parameters.names, list(disturbed))
        if parts and not plant.divisible:
            raise ArgumentError(
                "plant",
                f"{plant.name}, which goes on by whole samples",
                "one that goes on by parts of them",
                "Its advance(x, u, p, duration) has to take what is less than a sample, for dead times that end within "
                "one, lags, limits of rate, and measurements that are made there.",
            )

    def reset(self) -> None:
        """Begin a run."""
        for driven in (self._plant, *(substitute for _, substitute in self._substitutes)):
            if driven is not None:
                driven.reset()

    def advance(
        self,
        k: int,
        x: Array,
        held: Array,
        pieces: Sequence[Piece],
        given: Array,
        disturbance: Array,
        sensors: RunningSensors,
    ) -> Array:
        """State (nx,) one sample after x (nx,) at sample k.

        Parameters
        ----------
        held : ndarray, shape (plant nu,)
            All inputs; at the end, those that the sample ends with.
        pieces : sequence of Piece
            The controller's.
        given, disturbance : ndarray, shape (np_,)
            Parameters with faults, and without.
        sensors : RunningSensors
            They measure what is to be measured on the way.
        """
        driven = self._at(k)
        p = given if driven is self._plant else self._others(driven, given, disturbance)
        for piece in pieces:
            held[self._columns] = piece.mean
            if len(pieces) == 1:
                x = driven.advance(x, held, p)
            else:
                x = driven.advance(x, held, p, (piece.end - piece.begin) * self._dt)
            held[self._columns] = piece.last
            if piece.end in sensors.stops:
                sensors.pass_by(piece.end, k, x, held, given)
        return read_only(x)

    def _at(self, k: int) -> Plant | ForeignPlant:
        """What the last fault of sample k puts in the plant's place, if any does."""
        driven = self._plant
        for samples, substitute in self._substitutes:
            if substitute is not None and k in samples:
                driven = substitute
        return driven

    def _others(self, driven: Plant | ForeignPlant, given: Array, disturbance: Array) -> Array:
        """Parameters (np_,) of another plant: its own where nothing has set them."""
        return np.where(self._named | (given != disturbance), given, driven.default_parameters)


def _substitute(fault: Fault, plant: Plant | ForeignPlant) -> Plant | ForeignPlant | None:
    """What a fault drives in place of the plant, if anything; raises unless it has the same signals."""
    if fault.substitute is None:
        return None
    other = as_plant(fault.substitute, plant.sampling_time)
    for role in ("states", "inputs", "parameters"):
        found, expected = (
            dict(zip(s.names, s.units, strict=True)) for s in (getattr(other, role), getattr(plant, role))
        )
        if list(found.items()) != list(expected.items()):
            raise ArgumentError(
                f"{type(fault).__name__}.plant",
                f"{role} {', '.join(found) or 'none'}",
                f"those of the plant, in the same order and units: {', '.join(expected) or 'none'}",
            )
    return other
