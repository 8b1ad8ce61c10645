"""The log of a closed-loop run: an xarray.Dataset with names and units."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rumo.controllers import Controller
from rumo.model import Model
from rumo.plan import Plan
from rumo.signals import Array, Signals
from rumo.version import __version__

if TYPE_CHECKING:
    import xarray as xr


class Recorder:
    """Collects samples of a run and turns them into a dataset.

    Parameters
    ----------
    controller : Controller
        Names the states, inputs, outputs and constraints.
    plant : Model
        Names the plant's states and parameters.
    seed : int
        Seed of the run.
    """

    def __init__(self, controller: Controller, plant: Model, seed: int) -> None:
        self._controller = controller
        self._plant = plant
        self._seed = seed
        self._rows: dict[str, list[Any]] = {}

    def add(self, plan: Plan, **arrays: Array) -> None:
        """Record a sample: `time`, `plant`, `measured`, `estimated`, `applied`, `reference`, `disturbance`."""
        row = {
            **arrays,
            "commanded": plan.command.values,
            "predicted_states": plan.x.values,
            "predicted_inputs": plan.u.values,
            "slacks": plan.slacks.values,
            "status": plan.status.name,
            "prepare_time": plan.timings.prepare,
            "feedback_time": plan.timings.feedback,
            "step_time": plan.timings.total,
        }
        for name, value in row.items():
            self._rows.setdefault(name, []).append(value)

    def dataset(self) -> xr.Dataset:
        """Everything recorded, dimensions named, units in attributes and in a `..._unit` coordinate."""
        import xarray as xr  # heavy; a controller alone does without it

        problem, plant = self._controller.problem, self._plant
        model = problem.model
        axes: dict[str, tuple[tuple[str, ...], str]] = {
            "plant": (("plant_state",), "state of the plant"),
            "measured": (("state",), "measured states"),
            "estimated": (("state",), "states given to the controller"),
            "applied": (("input",), "input held from this sample to the next"),
            "commanded": (("input",), "input computed at this sample, applied `delay` samples later"),
            "reference": (("output",), "wanted outputs at this sample"),
            "disturbance": (("parameter",), "parameters of the plant from this sample to the next"),
            "predicted_states": (("stage", "state"), "predicted states, stage 0 is now"),
            "predicted_inputs": (("interval", "input"), "planned inputs, interval 0 starts now"),
            "slacks": (("interval", "constraint"), "violation of the path constraints at the interval's end"),
            "status": ((), "outcome of the step"),
        }
        signals = {
            "state": model.states,
            "input": model.inputs,
            "output": problem.outputs,
            "constraint": problem.constraint_names,
            "plant_state": plant.states,
            "parameter": plant.parameters,
        }
        data: dict[str, Any] = {}
        for name, (dims, meaning) in axes.items():
            attributes = {"long_name": meaning}
            if dims and dims[-1] in signals:
                attributes["units"] = _unit_list(signals[dims[-1]])
            data[name] = (("time", *dims), self._stacked(name, dims, signals), attributes)
        for name in ("prepare_time", "feedback_time", "step_time"):
            data[name] = (("time",), np.array(self._rows.get(name, [])), {"units": "s", "long_name": name})
        coordinates: dict[str, Any] = {
            "time": ("time", np.array(self._rows.get("time", []), dtype=float), {"units": "s", "long_name": "time"}),
            "stage": np.arange(problem.horizon + 1),
            "interval": np.arange(problem.horizon),
        }
        for dim, names in signals.items():
            coordinates[dim] = (dim, np.array(names.names, dtype=str))
            coordinates[f"{dim}_unit"] = (dim, np.array(names.units, dtype=str))
        coordinates["input_lower"] = ("input", problem.input_lower, {"units": _unit_list(model.inputs)})
        coordinates["input_upper"] = ("input", problem.input_upper, {"units": _unit_list(model.inputs)})
        attributes = {
            "title": f"{plant.name} under {self._controller.name}",
            "controller": self._controller.name,
            "model": model.name,
            "plant_model": plant.name,
            "seed": self._seed,
            "sampling_time_s": problem.sampling_time,
            "horizon": problem.horizon,
            "delay": problem.delay,
            "rumo_version": __version__,
        }
        return xr.Dataset(data, coordinates, attributes)

    def _stacked(self, name: str, dims: tuple[str, ...], signals: dict[str, Signals]) -> Any:
        rows = self._rows.get(name, [])
        if not dims:
            return np.array(rows, dtype=str)
        problem = self._controller.problem
        sizes = {"stage": problem.horizon + 1, "interval": problem.horizon}
        shape = [sizes[dim] if dim in sizes else len(signals[dim]) for dim in dims]
        return np.array(rows, dtype=float).reshape(len(rows), *shape)


def _unit_list(signals: Signals) -> str:
    return ", ".join(f"{name}: {signals.unit(name)}" for name in signals)


def save(log: xr.Dataset, path: str | Path) -> Path:
    """Write a log as NetCDF; the folder must exist."""
    log.to_netcdf(path, engine="h5netcdf")
    return Path(path)


def load(path: str | Path) -> xr.Dataset:
    """Read a log written by `save`."""
    import xarray as xr

    return xr.load_dataset(path, engine="h5netcdf")


def signal(log: xr.Dataset, variable: str, name: str) -> Array:
    """One signal of a log as an array (K,): `signal(log, "plant", "v_x")`."""
    dim = log[variable].dims[-1]
    return log[variable].sel({dim: name}).to_numpy()


def names(log: xr.Dataset, dim: str) -> Sequence[str]:
    """Signal names along a dimension of a log."""
    return [str(name) for name in log[dim].to_numpy()]
