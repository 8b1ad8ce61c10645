"""An FMU as a plant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, isclose
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from rumo.checks import as_mapping, finite_number, positive_number, whole_number
from rumo.errors import ArgumentError, CallOrderError, FileError, UnknownNameError
from rumo.extras import required
from rumo.model import Parameter
from rumo.signals import Array, Signals
from rumo.simulation.plants.fmu.ports import Port, as_ports, real_variables, resolved
from rumo.simulation.plants.fmu.slave import Slave

Given = Sequence[str] | Mapping[str, str | Port] | None
CLOSE = 1e-6
"""Difference, relative above 1, between where a run is to begin and where the FMU does that is no difference."""


class FmuPlant:
    """A functional mock-up unit for co-simulation, of FMI 2 or 3, run by FMPy.

    Its states are what it says of itself after each sample, its outputs if not told otherwise: what else goes on inside
    is its own. So it always goes on from where it is, and only `reset` brings it back to its beginning; two loops at
    the same time need one each, `copy.deepcopy(plant)`.

    An FMU is a program that does what it likes: run none that you would not trust otherwise.

    Parameters
    ----------
    file : path
        Of the FMU.
    sampling_time : float
        For which inputs are held [s].
    states, inputs, parameters : sequence of str, or mapping of str to str or Port
        Names that are those of real variables in the FMU, or which variables signals of these names are. All outputs,
        all inputs, and all tunable parameters if not given.
    values : mapping of str to float
        What variables of the FMU begin with, such as its other parameters, by their names there, in its own units.
    steps : int
        Of co-simulation in a sample.

    Raises
    ------
    FileError
        If it is no such FMU.
    ArgumentError
        If a value cannot work, or FMPy is not installed: `pip install "rumo[fmu]"`.
    """

    def __init__(
        self,
        file: str | PathLike[str],
        *,
        sampling_time: float,
        states: Given = None,
        inputs: Given = None,
        parameters: Given = None,
        values: Mapping[str, float] | None = None,
        steps: int = 1,
    ) -> None:
        self._settings = {
            "file": Path(file).absolute(),
            "sampling_time": sampling_time,
            "states": states,
            "inputs": inputs,
            "parameters": parameters,
            "values": values,
            "steps": steps,
        }
        self._file = Path(file)
        self.sampling_time = positive_number(sampling_time, "sampling_time")
        self._steps = whole_number(steps, "steps", 1)
        self._step = self.sampling_time / self._steps
        self._description = _described(self._file)
        self.name = str(self._description.modelName)
        variables = real_variables(self._description)
        by_causality: dict[str, list[str]] = {}
        for name, variable in variables.items():
            by_causality.setdefault(str(variable.causality), []).append(name)
        tunable = [name for name in by_causality.get("parameter", []) if variables[name].variability == "tunable"]
        ports = as_ports(states, "states", variables, by_causality.get("output", []))
        self._starts = {name: port.start or port.variable for name, port in ports.items()}
        self._x = resolved(ports, variables)
        self._u = resolved(as_ports(inputs, "inputs", variables, by_causality.get("input", [])), variables)
        named = as_ports(parameters, "parameters", variables, tunable)
        for name, port in named.items():
            if variables[port.variable].variability != "tunable":
                cure = "Give others by values={...}: they stay what they are in a run."
                raise ArgumentError(f"parameters[{name!r}]", repr(port.variable), "a tunable parameter", cure)
        self._p = resolved(named, variables)
        self.states, self.inputs = Signals(self._x.units, "states"), Signals(self._u.units, "inputs")
        if not len(self.states):
            raise ArgumentError("states", "none", "at least one", f"There are {', '.join(variables)}.")
        self._values: dict[str, float] = {}
        for name, value in as_mapping(values, "values").items():
            if name not in variables:
                raise UnknownNameError("values", name, variables)
            self._values[name] = finite_number(value, f"values[{name!r}]")
        self._variables = variables
        self.parameters = {
            name: Parameter(
                unit, port.factor * float(self._values.get(port.variable, variables[port.variable].start or 0.0))
            )
            for (name, port), unit in zip(named.items(), self._p.units.values(), strict=True)
        }
        self.divisible = bool(self._description.coSimulation.canHandleVariableCommunicationStepSize)
        self._slave: Slave | None = None
        self.reset()

    def reset(self) -> None:
        """Back to the beginning, which is where the next state that it is given is."""
        self._at: Array | None = None
        self._count, self._within = 0, 0.0

    def start(self, **states: float) -> dict[str, float]:
        """State in which it begins: `Scenario(x=plant.start())`; also a reset.

        Parameters
        ----------
        **states : float
            Where some of the states are to begin, if the FMU lets them.

        Raises
        ------
        UnknownNameError
            If it has no such state.
        ArgumentError
            If the FMU does not let it be set.
        """
        wanted: dict[str, float] = {}
        for name, value in states.items():
            self.states.index(name, "start")
            if not self._settable(name):
                raise ArgumentError(name, repr(value), "nothing: the FMU does not let it be set", CURE)
            wanted[name] = finite_number(value, name)
        x = self._begin(wanted, np.array([item.default for item in self.parameters.values()]))
        self.reset()
        return dict(zip(self.states, x.tolist(), strict=True))

    def advance(self, x: Array, u: Array, p: Array, duration: float | None = None) -> Array:
        """State one sampling time later, or a duration [s], see `rumo.simulation.PlantLike`.

        Raises
        ------
        PlantError
            If the FMU says that it cannot go on.
        ArgumentError
            If it does not begin at `x`.
        CallOrderError
            If it is not at `x`.
        """
        if self._at is None:
            wanted = {name: value for name, value in zip(self.states, x.tolist(), strict=True) if self._settable(name)}
            begun = self._begin(wanted, p)
            for name, value, found in zip(self.states, x.tolist(), begun.tolist(), strict=True):
                if not abs(value - found) <= CLOSE * max(1.0, abs(found)):
                    raise ArgumentError(f"x[{name!r}]", f"{value:g}", f"{found:g}, where {self.name} begins", CURE)
            self._at = x.copy()
        if not np.array_equal(x, self._at):
            raise CallOrderError(
                f"{self.name} goes on from where it is, {self._at.tolist()}, not from {x.tolist()}. "
                "Call reset() first; two loops at the same time need a copy.deepcopy each."
            )
        slave = self._running()
        slave.write(self._p.references, (p / self._p.factors).tolist() if len(p) else [])
        slave.write(self._u.references, (u / self._u.factors).tolist())
        if duration is None:
            for _ in range(self._steps):
                slave.go(self._count * self._step, self._step)
                self._count += 1
        else:
            self._go_on(slave, duration)
        self._at = self._read()
        return self._at.copy()

    def _go_on(self, slave: Slave, duration: float) -> None:
        """On by a part of a sample."""
        begin, steps = self._count * self._step + self._within, ceil(duration / self._step)
        for i in range(steps):
            slave.go(begin + i * duration / steps, duration / steps)
        self._within += duration
        if isclose(self._within, self.sampling_time):
            self._count, self._within = self._count + self._steps, 0.0

    def _settable(self, name: str) -> bool:
        variable = self._variables[self._starts[name]]
        return variable.variability != "constant" and variable.initial in ("exact", "approx")

    def _begin(self, wanted: Mapping[str, float], p: Array) -> Array:
        """State (nx,) at the beginning, with some of the states asked for."""
        factors = dict(zip(self.states, self._x.factors, strict=True))
        values = {self._variables[name].valueReference: value for name, value in self._values.items()}
        values |= dict(zip(self._p.references, (p / self._p.factors).tolist() if len(p) else [], strict=True))
        values |= {self._variables[self._starts[name]].valueReference: v / factors[name] for name, v in wanted.items()}
        self._running().begin(values)
        self._count, self._within = 0, 0.0
        return self._read()

    def _read(self) -> Array:
        return np.array(self._running().read(self._x.references)) * self._x.factors

    def _running(self) -> Slave:
        if self._slave is None:
            self._slave = Slave(self._file, self._description)
        return self._slave

    def __reduce__(self) -> tuple[Any, ...]:
        return _made, (self._settings,)

    def __deepcopy__(self, memo: dict[int, Any]) -> FmuPlant:
        return _made(self._settings)


CURE = 'Begin at plant.start(); a state is set by Port("name", start="variable") where the FMU has one for that.'


def _made(settings: dict[str, Any]) -> FmuPlant:
    return FmuPlant(**settings)


def _described(file: Path) -> Any:
    fmpy = required("fmpy", "fmu", "FmuPlant")
    expected = "an FMU for co-simulation, of FMI 2 or 3"
    try:
        description = fmpy.read_model_description(str(file))
    except Exception as error:  # FMPy's own are of this class
        raise FileError(file, None, str(error), expected) from None
    if description.coSimulation is None or description.fmiVersion == "1.0":
        kind = "co-simulation" if description.coSimulation else "model exchange alone"
        raise FileError(file, None, f"one for {kind}, of FMI {description.fmiVersion}", expected)
    return description
