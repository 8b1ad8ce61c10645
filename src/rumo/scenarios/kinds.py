"""What scenarios are made of, by class name, to be made from tables of files: `kind = "Gust"`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from functools import lru_cache
from types import MappingProxyType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

from rumo.actuation import Actuation, Actuator
from rumo.controllers import InnovationGate, QpOptions
from rumo.discretization import Discretization
from rumo.errors import ArgumentError, UnknownNameError
from rumo.estimation import Butterworth, ExtendedKalman, ExtraState, MovingHorizon, OutlierGate
from rumo.references import SinePath
from rumo.references.signals import Sampled, Sine
from rumo.registry import DISCRETIZATIONS
from rumo.simulation import Constant, DelayWatch, Gust, OrnsteinUhlenbeck, Patch, RandomWalk
from rumo.simulation.faults import KINDS as FAULTS
from rumo.simulation.faults import Changed

DISTURBANCES: tuple[type, ...] = (Constant, RandomWalk, OrnsteinUhlenbeck, Gust, Patch)
ESTIMATORS: tuple[type, ...] = (Butterworth, ExtendedKalman, MovingHorizon)
REFERENCES: tuple[type, ...] = (SinePath, Sine, Sampled)
PARTS: tuple[type, ...] = (Actuation, Actuator, DelayWatch, ExtraState, InnovationGate, OutlierGate, QpOptions)
FAULT_KINDS: tuple[type, ...] = tuple(kind for kind in FAULTS.values() if kind is not Changed)
"""All but one, which needs another plant."""

KINDS: Mapping[str, type] = MappingProxyType(
    {kind.__name__: kind for kind in (*DISTURBANCES, *FAULT_KINDS, *ESTIMATORS, *REFERENCES, *PARTS)}
)
"""Classes by their names."""
KIND = "kind"
"""Key of a table that says of which class it is."""
RANGES = {"from", "to"}, {"from", "samples"}
"""Keys of a table that stands for samples: the first, and the first after the last, or how many there are."""


def made(table: Mapping[str, Any], where: str, expected: type | None = None) -> Any:
    """What a table stands for.

    Parameters
    ----------
    table : mapping of str to plain data
        `kind`, a name in `KINDS`, and its parameters.
    where : str
        Of the table, for messages.
    expected : type, optional
        Its class, if it needs not say.

    Raises
    ------
    ArgumentError
        If kind or parameter is unknown, one is missing, or a value cannot be; the message begins with `where`.
    """
    parameters = {key: value for key, value in table.items() if key != KIND}
    if KIND in table or expected is None:
        name = table.get(KIND)
        if name is None:
            raise ArgumentError(where, f"a table without {KIND}", f'one with a line such as {KIND} = "Gust"')
        if not isinstance(name, str) or name not in KINDS:
            raise UnknownNameError(f"{where}.{KIND}", name, KINDS)
        expected = KINDS[name]
    known = {item.name: item for item in fields(expected) if item.init}
    for key in parameters:
        if key not in known:
            raise UnknownNameError(where, key, known, f"These are the parameters of {expected.__name__}.")
    needed = [n for n, item in known.items() if item.default is MISSING and item.default_factory is MISSING]
    for key in needed:
        if key not in parameters:
            raise ArgumentError(f"{where}.{key}", "nothing", f"a value for each of {', '.join(needed)}")
    hints = hints_of(expected)
    given = {key: as_hinted(value, hints.get(key), f"{where}.{key}") for key, value in parameters.items()}
    return called(expected, given, where)


def called(kind: Any, given: Mapping[str, Any], where: str) -> Any:
    """`kind(**given)`; an error begins with `where` and the parameter's name."""
    try:
        return kind(**given)
    except ArgumentError as error:
        argument = error.argument.removeprefix(f"{kind.__name__}.")
        named = f"{where}.{argument}" if argument.partition("[")[0].partition(".")[0] in given else where
        raise ArgumentError(named, error.got, error.expected, error.cure) from None
    except (TypeError, ValueError) as error:
        raise ArgumentError(where, repr(dict(given)), f"parameters of {kind.__name__}", str(error)) from None


@lru_cache(maxsize=256)
def hints_of(kind: type) -> Mapping[str, Any]:
    """Types of a class's fields, as far as they can be found."""
    try:
        return get_type_hints(kind)
    except (NameError, TypeError):  # names that exist for type checkers alone
        return {}


def as_hinted(value: Any, hint: Any, where: str) -> Any:
    """Plain data as a field of a type wants it: tables as dataclasses, lists as tuples, names as schemes."""
    options = options_of(hint)
    if value is None or (value == "none" and type(None) in options):
        return None
    if isinstance(value, str) and Discretization in options and str not in options:
        if value not in DISCRETIZATIONS:
            raise UnknownNameError(where, value, DISCRETIZATIONS)
        return DISCRETIZATIONS[value]()
    if isinstance(value, Mapping):
        if KIND in value:
            return made(value, where)
        if is_range(value) and range in options:
            return _samples(value, where)
        kind = next((option for option in options if isinstance(option, type) and is_dataclass(option)), None)
        if kind is not None:
            return made(value, where, kind)
        if hint is not None and not any(map(_is_mapping, options)):
            return made(value, where)
        inner = item_hint(hint)
        return {key: as_hinted(item, inner, f"{where}.{key}") for key, item in value.items()}
    if isinstance(value, list):
        return tuple(as_hinted(item, None, f"{where}.{i}") for i, item in enumerate(value))
    if isinstance(value, int) and not isinstance(value, bool) and float in options and int not in options:
        return float(value)
    return value


def options_of(hint: Any) -> tuple[Any, ...]:
    """Types that a hint leaves to choose from."""
    return get_args(hint) if get_origin(hint) in (UnionType, Union) else (hint,)


def item_hint(hint: Any) -> Any:
    """Type of the values of a mapping; None if it is not known."""
    return next((get_args(option)[-1] for option in options_of(hint) if _is_mapping(option)), None)


def _is_mapping(hint: Any) -> bool:
    origin = get_origin(hint)
    return isinstance(origin, type) and issubclass(origin, Mapping)


def is_range(table: Mapping[str, Any]) -> bool:
    """Whether a table stands for samples."""
    return any(table.keys() == keys for keys in RANGES)


def _samples(table: Mapping[str, Any], where: str) -> range:
    for key, value in table.items():
        if not isinstance(value, int) or isinstance(value, bool):
            raise ArgumentError(f"{where}.{key}", repr(value), "a whole number of samples")
    first = table["from"]
    return range(first, table["to"] if "to" in table else first + table["samples"])
