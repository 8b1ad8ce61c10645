"""Arguments of what makes a run: names, units, ranges and meanings, to be checked and listed."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from math import inf, isnan
from types import MappingProxyType, NoneType
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import numpy as np

from rumo.errors import ArgumentError, UnknownNameError

Plain = bool | int | float | str | list[Any] | dict[str, Any] | None
"""What files can hold; None stands for "none", where there may be nothing."""

KINDS: Mapping[type, str] = {bool: "true or false", int: "a whole number", float: "a number", str: "a text"}


@dataclass(frozen=True)
class Argument:
    """What is known of an argument: written in an annotation, `speed: Annotated[float, Argument("m/s")] = 8.0`.

    Parameters
    ----------
    unit : str
        "1" for none.
    meaning : str
        A sentence.
    above, least, most : float
        Limits of a number; the first excludes itself.
    choices : tuple of str
        What a text may be, if not anything.
    file : bool
        A text that may name a file: what is in it decides a run, not its name.
    kinds : tuple of type
        Those of its values; none for any. From the annotation.
    default : object
        From the signature.
    """

    unit: str = "1"
    meaning: str = ""
    above: float = -inf
    least: float = -inf
    most: float = inf
    choices: tuple[str, ...] = ()
    file: bool = False
    kinds: tuple[type, ...] = ()
    default: Any = inspect.Parameter.empty

    @property
    def needed(self) -> bool:
        """Whether there is no default."""
        return self.default is inspect.Parameter.empty

    @property
    def range(self) -> str:
        """What it may be, in words."""
        if self.choices:
            return f"one of {', '.join(self.choices)}"
        kinds = [KINDS[kind] for kind in KINDS if kind in self.kinds]
        kinds = [kind for kind in kinds if not (kind == KINDS[int] and float in self.kinds)]
        words = " or ".join(kinds) or "a value"
        limits = [
            *([f"above {self.above:g}"] if self.above > -inf else []),
            *([f"of at least {self.least:g}"] if self.least > -inf else []),
            *([f"of at most {self.most:g}"] if self.most < inf else []),
        ]
        return f"{' '.join([words, ' and '.join(limits)]).strip()}{', or none' if NoneType in self.kinds else ''}"

    def takes(self, value: Plain) -> bool:
        """Whether a value is meant for it: tables and lists are not, where it is a number or a text."""
        return not (self.kinds and isinstance(value, Mapping | list))

    def checked(self, value: Plain, name: str) -> Plain:
        """A value in its proper form; anything else raises, naming the argument."""
        if isinstance(value, np.generic):
            value = value.item()
        if value is None or (value == "none" and NoneType in self.kinds):
            if self.kinds and NoneType not in self.kinds:
                raise ArgumentError(name, "nothing", self.range)
            return None
        if float in self.kinds and isinstance(value, int) and not isinstance(value, bool):
            value = float(value)
        right = not self.kinds or type(value) in self.kinds
        if right and isinstance(value, int | float) and not isinstance(value, bool):
            right = not isnan(value) and self.above < value and self.least <= value <= self.most
        if not right or (self.choices and value not in self.choices):
            if self.choices and isinstance(value, str):
                raise UnknownNameError(name, value, self.choices)
            raise ArgumentError(name, repr(value), self.range)
        return value


@lru_cache(maxsize=64)
def arguments_of(make: Callable[..., Any]) -> Mapping[str, Argument]:
    """Keyword arguments of a function, as far as its signature and annotations tell.

    Raises
    ------
    ArgumentError
        If it has arguments that cannot be given by name.
    """
    try:
        hints = get_type_hints(make, include_extras=True)
    except (NameError, TypeError):  # names that exist for type checkers alone
        hints = {}
    found: dict[str, Argument] = {}
    for name, parameter in inspect.signature(make).parameters.items():
        if parameter.kind not in (parameter.KEYWORD_ONLY, parameter.POSITIONAL_OR_KEYWORD):
            expected = "arguments that have names"
            raise ArgumentError(getattr(make, "__name__", repr(make)), f"the argument {parameter}", expected)
        found[name] = replace(_annotated(hints.get(name)), default=parameter.default)
    return MappingProxyType(found)


def _annotated(hint: Any) -> Argument:
    argument = Argument()
    if get_origin(hint) is Annotated:
        hint, *extras = get_args(hint)
        argument = next((extra for extra in extras if isinstance(extra, Argument)), argument)
    options = get_args(hint) or (hint,)
    known = (*KINDS, NoneType)
    return replace(argument, kinds=tuple(options) if all(option in known for option in options) else ())
