"""Checks of arguments: each returns the value in its proper form or raises, naming the argument."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any, TypeGuard, TypeVar

import numpy as np
from numpy.typing import NDArray

from rumo.errors import ArgumentError, ShapeError, UnknownNameError

T = TypeVar("T")
UNITS = "Choose a unit in which the signal is neither tiny nor huge."
LARGEST = 2**31 - 1
"""The largest int that the C core takes."""
SMALLEST = float(np.finfo(float).tiny)
"""The smallest positive number whose reciprocal is a number."""
FARTHEST = 2.0**1022
"""Two numbers up to this size have a difference."""
LARGEST_FLOAT = float(np.finfo(float).max)


def whole_number(value: object, argument: str, least: int, most: float = LARGEST) -> int:
    """`value` as an int from `least` to `most`; anything else raises, naming `argument`."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise ArgumentError(argument, repr(value), f"a whole number of at least {least}")
    if value > most:
        raise ArgumentError(argument, repr(value), f"a whole number of at most {most}")
    return int(value)


def positive_number(value: object, argument: str) -> float:
    """`value` as a positive finite float; anything else raises, naming `argument`."""
    if not _is_number(value):
        raise ArgumentError(argument, repr(value), "a positive number")
    number = as_float(value)
    if not 0.0 < number < np.inf:
        raise ArgumentError(argument, repr(value), "a positive finite number")
    if number < SMALLEST:
        raise ArgumentError(argument, repr(value), f"a positive number of at least {SMALLEST:.4g}", UNITS)
    return number


def non_negative_number(value: object, argument: str) -> float:
    """`value` as a float of at least 0; anything else raises, naming `argument`."""
    if not _is_number(value) or not value >= 0.0:
        raise ArgumentError(argument, repr(value), "a number of at least 0")
    number = as_float(value)
    if number == np.inf and value != np.inf:
        raise ArgumentError(argument, repr(value), f"a number of at least 0, at most {LARGEST_FLOAT:.4g} or infinite")
    return number


def share(value: object, argument: str) -> float:
    """`value` as a float from 0 to 1; anything else raises, naming `argument`."""
    if not _is_number(value) or not 0.0 <= value <= 1.0:
        raise ArgumentError(argument, repr(value), "a share from 0 to 1")
    return as_float(value)


def finite_number(value: object, argument: str) -> float:
    """`value` as a finite float; anything else raises, naming `argument`."""
    if not _is_number(value) or not np.isfinite(as_float(value)):
        raise ArgumentError(argument, repr(value), "a finite number")
    return float(value)


def as_float(value: float) -> float:
    """Whole numbers beyond the largest float are as good as infinite."""
    try:
        return float(value)
    except OverflowError:
        return np.inf if value > 0 else -np.inf


def _is_number(value: object) -> TypeGuard[float]:
    """Whether a value is a number, and no truth value; NumPy's complex numbers fail when they are used, loudly."""
    return isinstance(value, (int, float, np.number)) and not isinstance(value, bool)


def printable(value: object, argument: str, expected: str = "text") -> str:
    """`value`, a text of one line; control characters and halves of surrogate pairs raise: files do not keep them."""
    if not isinstance(value, str):
        raise ArgumentError(argument, repr(value), expected)
    if not value.isprintable():
        raise ArgumentError(argument, repr(value), f"{expected} without control characters or other unprintable ones")
    return value


def a_name(value: object, argument: str) -> str:
    """`value`, a name that readers can see; an empty one raises, and so does one that `printable` refuses."""
    if not printable(value, argument, "a name").strip():
        raise ArgumentError(argument, f"the name {value!r}", "a name that is not empty")
    return str(value)


def as_numbers(value: object, argument: str) -> NDArray[np.floating[Any]]:
    """`value`, real numbers, as an array of floats; no text, and no None, which NumPy takes for NaN."""
    try:
        array = np.asarray(value)
        if array.dtype.kind in "biuf" or (array.dtype.kind == "O" and None not in array.ravel().tolist()):
            return array.astype(float)
    except (TypeError, ValueError, OverflowError):
        pass
    raise ShapeError(argument, repr(value), "numbers")


def as_list(value: object, argument: str, expected: str) -> list[Any]:
    """`value`, an array or a sequence that is no text, as a list with something in it."""
    if isinstance(value, str) or not isinstance(value, Sequence | np.ndarray) or not len(value):
        raise ArgumentError(argument, repr(value), expected)
    return list(value)


def as_names(value: object, argument: str) -> tuple[str, ...]:
    """`value`, a sequence of names, as a tuple. A text raises: to Python it is a sequence of letters."""
    if isinstance(value, str):
        raise ArgumentError(argument, repr(value), "a tuple of names", f"Write ({value!r},).")
    names: tuple[Any, ...] = tuple(value) if isinstance(value, Iterable) else (value,)
    if not all(isinstance(name, str) for name in names):
        raise ArgumentError(argument, repr(value), "a tuple of names")
    return names


def as_mapping(value: object, argument: str) -> dict[str, Any]:
    """`value` as a dict, empty for None; anything but a mapping raises."""
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise ArgumentError(argument, repr(value), "a mapping from names")
    return dict(value)


def checked_items(items: object, argument: str, kind: type[T], example: str) -> dict[str, T]:
    """`items` as a dict whose values are of a kind; `example` shows how to write one."""
    found = as_mapping(items, argument)
    for name, item in found.items():
        checked(item, f"{argument}[{name!r}]", kind, f"Write {example}.")
    return found


def checked(value: object, argument: str, kind: type[T], cure: str = "") -> T:
    """`value`, which must be of a kind."""
    if not isinstance(value, kind):
        shown = value.__name__ if isinstance(value, type) else repr(value)
        raise ArgumentError(argument, shown, f"a rumo.{kind.__name__}", cure)
    return value


def check_signature(function: Callable[..., Any], argument: str, count: int, expected: str, cure: str) -> None:
    """Raise unless a function can be called with so many arguments."""
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):  # of some built-in functions
        return
    try:
        signature.bind(*[None] * count)
    except TypeError:
        raise ArgumentError(argument, f"a function of {signature}", expected, cure) from None


def known_names(names: Collection[str], argument: str, known: Collection[str]) -> None:
    """Raises unless there is a name, and all are known."""
    if not as_names(names, argument):
        raise ArgumentError(argument, "none", f"some of {', '.join(known)}")
    for name in names:
        if name not in known:
            raise UnknownNameError(argument, name, list(known))
