"""Which variables of an FMU are which signals."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rumo.checks import finite_number, printable
from rumo.errors import ArgumentError, UnknownNameError

REAL = ("Real", "Float64")
"""Types of variables that are real numbers, in FMI 2 and 3."""


@dataclass(frozen=True)
class Port:
    """A variable of an FMU, as a signal of ours.

    Parameters
    ----------
    variable : str
        Its name in the FMU.
    unit : str, optional
        Of the signal; the FMU's, written as ours (`m/s2` is `m/s^2`, `N.m` is `N m`), if not given.
    factor : float
        The signal in units of the variable: `pi / 180` for one in degrees as a signal in radians. Needs a unit.
    start : str, optional
        For states: which variable, in the same unit, says where it begins; itself, if the FMU lets it be set, if not
        given.
    """

    variable: str
    unit: str | None = None
    factor: float = 1.0
    start: str | None = None

    def __post_init__(self) -> None:
        printable(self.variable, "variable")
        if finite_number(self.factor, "factor") == 0.0:
            raise ArgumentError("factor", "0", "another number")
        if self.factor != 1.0 and self.unit is None:
            raise ArgumentError("unit", "None", f"the unit of a signal that is {self.factor:g} times its variable")


@dataclass(frozen=True)
class Ports:
    """Some signals, in vector order, and how to find them in an FMU.

    Attributes
    ----------
    units : mapping of str to str
        Of each signal.
    references : tuple of int
        By which the FMU knows the variables.
    factors : tuple of float
        Signals in units of the variables.
    """

    units: dict[str, str]
    references: tuple[int, ...]
    factors: tuple[float, ...]


def real_variables(description: Any) -> dict[str, Any]:
    """Variables of a model description that are real numbers, by name; no arrays."""
    return {v.name: v for v in description.modelVariables if v.type in REAL and not v.dimensions}


def as_ports(given: object, argument: str, variables: Mapping[str, Any], defaults: list[str]) -> dict[str, Port]:
    """Ports by the names of signals, from what a user wrote.

    Parameters
    ----------
    given : None, sequence of str, or mapping of str to str or Port
        Names that are those of the FMU; or which variables they mean. All of `defaults` if None.
    argument : str
        What to call it in a message.
    variables : mapping
        All real variables of the FMU.
    defaults : list of str
        Variables that are taken without being named.
    """
    if given is None:
        given = defaults
    items: Any = given.items() if isinstance(given, Mapping) else [(name, name) for name in _names(given, argument)]
    ports: dict[str, Port] = {}
    for name, port in items:
        ports[name] = port if isinstance(port, Port) else Port(port)
        for variable in (ports[name].variable, ports[name].start):
            if variable is not None and variable not in variables:
                raise UnknownNameError(f"{argument}[{name!r}]", variable, variables)
    return ports


def _names(given: object, argument: str) -> list[Any]:
    if isinstance(given, str) or not isinstance(given, list | tuple):
        expected = 'names, or a mapping such as {"v_x": "body.v", "delta": Port("wheel", "rad", 0.0628)}'
        raise ArgumentError(argument, repr(given), expected)
    return list(given)


def resolved(ports: Mapping[str, Port], variables: Mapping[str, Any]) -> Ports:
    """What it takes to read and to write them."""
    found = [variables[port.variable] for port in ports.values()]
    units = {
        name: rumo_unit(variable.unit) if port.unit is None else port.unit
        for (name, port), variable in zip(ports.items(), found, strict=True)
    }
    references = tuple(variable.valueReference for variable in found)
    return Ports(units, references, tuple(port.factor for port in ports.values()))


def rumo_unit(unit: str | None) -> str:
    """A unit as FMI writes them, written as ours: powers with a caret, products with a blank."""
    return re.sub(r"(?<=[A-Za-z])(?=-?\d)", "^", unit or "1").replace(".", " ")
