"""What is measured of the plant, and how well."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from rumo.actuation.timing import in_samples
from rumo.checks import as_mapping, as_names
from rumo.errors import ArgumentError, UnknownNameError
from rumo.estimation.lateness import lateness
from rumo.model import Model
from rumo.signals import Array, Signals
from rumo.simulation.foreign import ForeignPlant
from rumo.simulation.plant import Plant

AnyPlant = Plant | ForeignPlant


@dataclass(frozen=True)
class Sensors:
    """Which signals of the plant are measured, with which Gaussian noise, and how late.

    Parameters
    ----------
    noise : mapping of str to float
        Standard deviation by signal, in its unit; none where not given. Noise on a state of the plant is that of its
        sensor: measured outputs that are computed from the state have it too, unless they have noise of their own.
    measured : tuple of str, optional
        States and outputs of the plant; those named like the states of the controller's model if not given. With any
        others an estimator has to find the states.
    late : mapping of str to float
        Samples, and fractions of one, from a measurement to its arrival; NaN comes until the first has arrived. With a
        fraction the plant is measured between two samples.
    age : mapping of str to float
        The same in seconds, for measurements that `late` does not name.
    """

    noise: Mapping[str, float] = field(default_factory=dict[str, float])
    measured: tuple[str, ...] | None = None
    late: Mapping[str, float] = field(default_factory=dict[str, float])
    age: Mapping[str, float] = field(default_factory=dict[str, float])

    def __post_init__(self) -> None:
        if self.measured is not None:
            as_names(self.measured, "measured")
        as_mapping(self.noise, "noise")
        as_mapping(self.late, "late")
        as_mapping(self.age, "age")

    def names(self, model: Model) -> tuple[str, ...]:
        """What is measured, for a controller of this model."""
        return model.states.names if self.measured is None else tuple(self.measured)

    def signals(self, plant: AnyPlant, model: Model) -> Signals:
        """Names and units of what is measured; raises unless these settings, plant and model fit together."""
        names = self.names(model)
        known = (*plant.states, *plant.outputs)
        for name in names:
            if name not in known:
                needed = name in model.states
                cure = f"Give {plant.name} an output of this name: the controller needs it as a state."
                raise UnknownNameError("plant" if needed else "measured", name, known, cure if needed else "")
        require_same_units(plant, model, names)
        signals = Signals({name: unit_of(plant, name) for name in names}, "measured")
        self._check_numbers(plant, signals)
        return signals

    def deviations(self, signals: Signals) -> Array:
        """Standard deviation of the noise on each of some signals (n,)."""
        return np.array([self.noise.get(name, 0.0) for name in signals], dtype=float)

    def start(self, plant: AnyPlant, signals: Signals, samples: int, rng: np.random.Generator) -> RunningSensors:
        """Sensors of these signals for a run of so many samples, with all of their noise."""
        return RunningSensors(self, plant, signals, samples, rng)

    def _check_numbers(self, plant: AnyPlant, signals: Signals) -> None:
        sources = Signals({name: unit_of(plant, name) for name in dict.fromkeys((*plant.states, *signals))}, "noise")
        sources.finite_vector(self.noise, "noise", np.zeros(len(sources)))
        for name, value in self.noise.items():
            if value < 0.0:
                raise ArgumentError(f"noise[{name!r}]", f"{value:g}", "a standard deviation of 0 or more")
        self.lateness(signals, plant.sampling_time)

    def lateness(self, signals: Signals, sampling_time: float) -> Array:
        """Samples, and fractions of one, from each measurement to its arrival (m,)."""
        return lateness(self.late, self.age, signals, sampling_time, "sensors")


class RunningSensors:
    """Sensors at work.

    Attributes
    ----------
    signals : Signals
        What is measured.
    stops : tuple of float
        Shares of each sample at which something is measured, besides its end.
    """

    def __init__(
        self, sensors: Sensors, plant: AnyPlant, signals: Signals, samples: int, rng: np.random.Generator
    ) -> None:
        self.signals = signals
        self._observe = plant.observer(signals.names)
        self._noise = sensors.deviations(plant.states) * rng.standard_normal((samples, len(plant.states)))
        # Outputs with noise of their own: computed from the true state.
        self._own = np.array([name in sensors.noise and name not in plant.states for name in signals], dtype=bool)
        own = np.where(self._own, sensors.deviations(signals), 0.0)
        self._own_noise = own * rng.standard_normal((samples, len(signals))) if self._own.any() else None
        late = [in_samples(samples) for samples in sensors.lateness(signals, plant.sampling_time).tolist()]
        self._late = np.array([whole for whole, _ in late], dtype=int)
        self._any_late = bool(self._late.any())
        self._within = np.array([1.0 - share for _, share in late])
        self.stops: tuple[float, ...] = tuple(sorted({*self._within.tolist()} - {1.0}))
        self._between = np.full(len(signals), np.nan)
        self._read: list[Array] = []

    def read(self, k: int, x: Array, u: Array, p: Array) -> Array:
        """What arrives at sample k (m,), of a plant in state x with input u held since the sample before."""
        values = self._measured(k, x, u, p)
        if self.stops:
            values, self._between = np.where(self._within < 1.0, self._between, values), np.full(len(values), np.nan)
        if not self._any_late:
            return values
        self._read.append(values)
        late = zip(self._late, range(len(values)), strict=True)
        return np.array([self._read[k - samples][j] if samples <= k else np.nan for samples, j in late])

    def pass_by(self, share: float, k: int, x: Array, u: Array, p: Array) -> None:
        """Measure a share of a sample after sample k what is to be measured there."""
        if k + 1 < len(self._noise):
            here = self._within == share
            self._between = np.where(here, self._measured(k + 1, x, u, p), self._between)

    def _measured(self, row: int, x: Array, u: Array, p: Array) -> Array:
        values = self._observe(x + self._noise[row], u, p)
        if self._own_noise is not None:
            values = np.where(self._own, self._observe(x, u, p) + self._own_noise[row], values)
        return values


def unit_of(plant: AnyPlant, name: str) -> str:
    """Unit of a state, input or output of a plant."""
    signals = next(group for group in (plant.states, plant.inputs, plant.outputs) if name in group)
    return signals.unit(name)


def require_same_units(plant: AnyPlant, model: Model, names: Iterable[str]) -> None:
    """Raise if a signal that plant and model share has another unit in each."""
    shared = {name for signals in model.signals for name in signals}
    for name in names:
        if name in shared and unit_of(plant, name) != model.unit(name):
            raise ArgumentError(
                "plant",
                f"{name!r} in {unit_of(plant, name)}",
                f"the controller's unit, {model.unit(name)}",
                "Rumo does not convert units.",
            )


def known_observer(plant: AnyPlant, names: Iterable[str]) -> Callable[[Array, Array, Array], Array]:
    """Function `(x, u, p) -> (n,)` of signals, NaN where the plant has none of that name."""
    names = tuple(names)
    columns = [i for i, name in enumerate(names) if name in plant.states or name in plant.outputs]
    observe = plant.observer(tuple(names[i] for i in columns))
    if len(columns) == len(names):
        return observe

    def observed(x: Array, u: Array, p: Array) -> Array:
        values = np.full(len(names), np.nan)
        values[columns] = observe(x, u, p)
        return values

    return observed
