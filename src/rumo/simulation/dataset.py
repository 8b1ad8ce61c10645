"""From rows to a log: an `xarray.Dataset` with names and units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rumo.interrupts import interruptible
from rumo.problem import Problem
from rumo.signals import Array, Signals
from rumo.simulation.computed import completed, limits_at
from rumo.simulation.rows import Row, column, columns_of_plans, columns_of_readings
from rumo.simulation.variables import RESCUED, TEXTS, TIMES, UNITLESS
from rumo.version import __version__

if TYPE_CHECKING:
    import xarray as xr


class Log:
    """What a log is to hold.

    Parameters
    ----------
    problem : Problem
        Of the controller.
    signals : mapping of str to Signals
        By the dimensions that they name.
    variables : mapping of str to (tuple of str, str)
        Dimensions after time, and meaning, see `rumo.simulation.variables`.
    measured : Signals
        What is measured.
    """

    def __init__(
        self,
        problem: Problem,
        signals: Mapping[str, Signals],
        variables: Mapping[str, tuple[tuple[str, ...], str]],
        measured: Signals,
    ) -> None:
        self._problem, self._signals, self._variables, self._measured = problem, signals, variables, measured

    def of(self, rows: Sequence[Row], attributes: Mapping[str, Any]) -> xr.Dataset:
        """The log of rows, with attributes beside those of the problem."""
        import xarray as xr  # heavy; a controller alone does without it

        problem = self._problem
        columns = self._columns(rows)
        with interruptible():
            numbers = [row["numbers"] for row in rows]
            if rows:
                columns |= completed(problem, columns, numbers)
            limits = limits_at(problem, numbers)
        data: dict[str, Any] = {}
        for name, (dims, meaning) in self._variables.items():
            described = {"long_name": meaning}
            if name in UNITLESS or (dims and name not in TEXTS):
                described["units"] = "1" if name in UNITLESS else self._units(dims[-1])
            data[name] = (("time", *dims), columns[name], described)
        for name in TIMES:
            data[name] = (("time",), column(rows, name), {"units": "s", "long_name": name})
        data["rescued"] = (("time",), column(rows, "rescued", kind=bool), {"long_name": RESCUED})
        coordinates: dict[str, Any] = {
            "time": ("time", column(rows, "time"), {"units": "s", "long_name": "time"}),
            "stage": np.arange(problem.horizon + 1),
            "interval": np.arange(problem.horizon),
        }
        for dim, names in self._signals.items():
            coordinates[dim] = (dim, np.array(names.names, dtype=str))
            coordinates[f"{dim}_unit"] = (dim, np.array(names.units, dtype=str))
        for dim, sides in limits.items():
            for side, values in zip(("lower", "upper"), sides, strict=True):
                coordinates[f"{dim}_{side}"] = (("time", dim), values, {"units": self._units(dim)})
        own = {"sampling_time_s": problem.sampling_time, "horizon": problem.horizon, "delay": problem.delay}
        return xr.Dataset(data, coordinates, {**attributes, **own, "rumo_version": __version__})

    def _columns(self, rows: Sequence[Row]) -> dict[str, Array]:
        """What rows say of each variable (K, ...)."""
        columns = columns_of_plans(rows, self._problem)
        columns |= columns_of_readings(rows, self._measured, self._problem.model.states)
        for name, (dims, _) in self._variables.items():
            if name not in columns:
                columns[name] = column(rows, name, self._shape(dims), str if name in TEXTS else float)
        return columns

    def _shape(self, dims: tuple[str, ...]) -> tuple[int, ...]:
        return tuple(self._problem.horizon if dim == "interval" else len(self._signals[dim]) for dim in dims)

    def _units(self, dim: str) -> str:
        signals = self._signals[dim]
        return ", ".join(f"{name}: {signals.unit(name)}" for name in signals)
