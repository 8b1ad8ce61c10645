"""A drive as figures of merit see it: its log, and what a log does not say."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from rumo.references import Path, SpeedProfile, Track, deviations
from rumo.signals import Array
from rumo.simulation.foreign import as_plant
from rumo.simulation.log import names, signal
from rumo.vehicles import VehicleParameters

if TYPE_CHECKING:
    import xarray as xr

TRUE = ("plant", "true_observed", "true_states", "true_outputs")
"""Variables of a log that say what the car did, best first."""
FRICTION_USE = "friction_use_"
"""With which the names of a plant's outputs begin that say how much of its friction a tyre uses."""


@dataclass(frozen=True, eq=False)
class Driven:
    """A drive, and what there was to be driven; what is left out leaves out the figures that need it.

    Parameters
    ----------
    log : xarray.Dataset
        Of the drive.
    track : Track, optional
        On which it was to stay.
    path : Path, optional
        Along which, if not in the track's middle.
    profile : SpeedProfile, optional
        How fast, along the path.
    car : VehicleParameters, optional
        Of the size of the plant.
    plant : Model, Plant or PlantLike, optional
        That was driven: it knows the forces of its tyres.
    begin : float
        Arc length at which the car was at first, and at which laps begin [m].
    """

    log: xr.Dataset
    track: Track | None = None
    path: Path | None = None
    profile: SpeedProfile | None = None
    car: VehicleParameters | None = None
    plant: Any = None
    begin: float = 0.0

    def __post_init__(self) -> None:
        if self.path is None and self.track is not None:
            object.__setattr__(self, "path", self.track.path)

    @property
    def sampling_time(self) -> float:
        """[s]."""
        return float(self.log.attrs["sampling_time_s"])

    @property
    def time(self) -> Array:
        """Of the samples (K,) [s]."""
        return self.log["time"].to_numpy()

    def true(self, name: str) -> Array | None:
        """A signal (K,) of the car as it was, not as it was measured; None if the log does not say."""
        for variable in TRUE:
            if variable in self.log and name in names(self.log, str(self.log[variable].dims[-1])):
                return signal(self.log, variable, name)
        return None

    def motion(self, *wanted: str) -> tuple[Array, ...] | None:
        """Several such signals; None unless the log has them all."""
        found = [self.true(name) for name in wanted]
        return None if any(values is None for values in found) else tuple(v for v in found if v is not None)

    @cached_property
    def deviations(self) -> dict[str, Array]:
        """See `rumo.references.deviations`; nothing without a path."""
        place = self.motion("p_x", "p_y")
        if self.path is None or place is None or not len(self.time):
            return {}
        known = {name: self.true(name) for name in ("psi", "v_x", "v_y")}
        x = {"p_x": place[0], "p_y": place[1], **{name: values for name, values in known.items() if values is not None}}
        return deviations(self.path, x, self.profile, near=self.begin)

    @cached_property
    def room(self) -> Array | None:
        """From the outline of the car to the nearer edge of the track (K,), negative beyond it [m]."""
        pose = self.motion("p_x", "p_y", "psi")
        if self.track is None or self.car is None or pose is None or not len(self.time):
            return None
        x, y, psi = pose
        path, reach = self.track.path, self.car.length
        progress = self.deviations["progress"]
        if path is not self.path:
            # Where a track crosses itself, its nearest point may be that of the other way: the heading tells.
            near = path.project((x[0], y[0]), heading=float(psi[0]))
            progress = deviations(path, {"p_x": x, "p_y": y}, near=near)["progress"]
        found = np.full(len(x), np.inf)
        for forward, left in _outline(self.car):
            at_x = x + forward * np.cos(psi) - left * np.sin(psi)
            at_y = y + forward * np.sin(psi) + left * np.cos(psi)
            every = zip(at_x.tolist(), at_y.tolist(), progress.tolist(), strict=True)
            s = np.array([path.nearest(at[0], at[1], at[2] - reach, at[2] + reach) for at in every])
            found = np.minimum(found, self.track.clearance(s, at_x, at_y))
        return found

    @cached_property
    def acceleration(self) -> tuple[Array, Array] | None:
        """Of the centre of gravity along the car and to its left, means between samples (K - 1,) each [m/s^2]."""
        motion = self.motion("psi", "v_x", "v_y")
        if motion is None or len(self.time) < 2:
            return None
        psi, v_x, v_y = motion
        velocity = (v_x + 1j * v_y) * np.exp(1j * psi)
        turned = np.diff(velocity) / self.sampling_time * np.exp(-0.5j * (psi[1:] + psi[:-1]))
        return turned.real, turned.imag

    @cached_property
    def friction_use(self) -> dict[str, Array]:
        """Force of each tyre over mu F_z at the samples (K,), by wheel; nothing if the plant does not say."""
        if self.plant is None or not len(self.time):
            return {}
        plant = as_plant(self.plant, self.sampling_time)
        outputs = tuple(name for name in plant.outputs if name.startswith(FRICTION_USE))
        if not outputs:
            return {}
        observe = plant.observer(outputs)
        x, p = self.log["plant"].to_numpy(), self.log["disturbance"].to_numpy()
        u = np.zeros((len(x), len(plant.inputs)))
        for name in names(self.log, "input"):
            # Forces at a sample are those that the input before it has led to.
            applied = signal(self.log, "applied", name)
            u[:, plant.inputs.index(name)] = np.r_[applied[:1], applied[:-1]]
        used = np.array([observe(*at) for at in zip(x, u, p, strict=True)])
        return {name.removeprefix(FRICTION_USE): used[:, i] for i, name in enumerate(outputs)}

    @cached_property
    def laps(self) -> list[float]:
        """Times of the laps that were completed [s]; of an open path, from its beginning to its end."""
        if self.path is None or not self.deviations:
            return []
        driven = np.fmax.accumulate(self.deviations["progress"]) - self.begin
        length = self.path.length if self.path.closed else self.path.length - self.begin
        count = int(np.nanmax(driven, initial=0.0) // length) if length > 0.0 else 0
        count = count if self.path.closed else min(count, 1)
        lines = [0.0, *(self._crossed(driven, (lap + 1) * length) for lap in range(count))]
        return np.diff(lines).tolist()

    def _crossed(self, driven: Array, distance: float) -> float:
        """When a distance was reached, linear between samples [s]."""
        i = int(np.argmax(driven >= distance))
        if i == 0:
            return float(self.time[0])
        share = (distance - driven[i - 1]) / (driven[i] - driven[i - 1])
        return float(self.time[i - 1] + share * (self.time[i] - self.time[i - 1]))


def driven(run: Any, log: xr.Dataset) -> Driven:
    """A log of a run, and what the run knows besides: what its method `driven` says, else the plant of a scenario."""
    known = getattr(run, "driven", None)
    return Driven(log, plant=getattr(run, "plant", None)) if known is None else known(log)


def _outline(car: VehicleParameters) -> list[tuple[float, float]]:
    """Points ahead of the centre of gravity and to its left [m]: corners, and the middles of the sides, which come
    closest to the inner edge of a bend."""
    front, rear = car.ends
    return [
        (ahead, left) for ahead in (front, 0.5 * (front + rear), rear) for left in (0.5 * car.width, -0.5 * car.width)
    ]
