"""Named signals with units, and arrays and expressions that answer to the names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import isfinite
from typing import Any, Generic, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rumo.checks import printable
from rumo.errors import ArgumentError, ShapeError, UnknownAttributeError, UnknownNameError

T = TypeVar("T")
Array = NDArray[np.floating[Any]]
Values = Mapping[str, float] | Sequence[float] | ArrayLike


def read_only(values: ArrayLike) -> Array:
    """A copy as floats that cannot be written to: whoever has it may keep it."""
    array = np.array(values, dtype=float)
    array.flags.writeable = False
    return array


class Signals:
    """An ordered, immutable set of signal names, each with a unit.

    Parameters
    ----------
    units : mapping of str to str
        Unit of each signal, in the order of the vector they form.
    role : str
        What the signals are ("states"), for messages.

    Raises
    ------
    ArgumentError
        If a name is not a Python identifier or a unit is no printable text.
    """

    def __init__(self, units: Mapping[str, str], role: str) -> None:
        if not hasattr(units, "items"):
            raise ArgumentError(role, repr(units), 'a mapping from name to unit such as {"angle": "rad"}')
        for name, unit in units.items():
            if not isinstance(name, str) or not name.isidentifier() or name.startswith("_"):
                raise ArgumentError(role, f"the name {name!r}", "a Python identifier such as 'yaw_rate'")
            if not isinstance(unit, str):
                raise ArgumentError(
                    f"{role}[{name!r}]", repr(unit), "a unit as text", 'Write "1" for a signal without unit.'
                )
            printable(unit, f"{role}[{name!r}]")
        self._units = dict(units)
        self._index = {name: i for i, name in enumerate(self._units)}
        self.role = role

    @property
    def names(self) -> tuple[str, ...]:
        """Signal names in vector order."""
        return tuple(self._units)

    @property
    def units(self) -> tuple[str, ...]:
        """Units in vector order."""
        return tuple(self._units.values())

    def unit(self, name: str) -> str:
        """Unit of one signal."""
        return self._units[name]

    def index(self, name: str, argument: str | None = None) -> int:
        """Position of `name` in the vector; unknown names raise, naming `argument`."""
        try:
            return self._index[name]
        except (KeyError, TypeError):
            raise UnknownNameError(argument or self.role, name, self._units) from None

    def vector(self, values: Values, argument: str, default: Array | None = None) -> Array:
        """Return `values` as an array of shape (n,) in vector order.

        Parameters
        ----------
        values : mapping of str to float, or sequence of n floats
            A mapping must name every signal unless `default` is given.
        argument : str
            What to call `values` in a message.
        default : ndarray, shape (n,), optional
            Values of the signals that a mapping leaves out.

        Raises
        ------
        ShapeError
            If the length is not n or a value is not a number.
        UnknownNameError
            If the mapping names a signal that does not exist.
        ArgumentError
            If the mapping leaves out a signal and there is no default.
        """
        if isinstance(values, Mapping):
            return self._from_mapping(values, argument, default)
        try:
            vector = np.asarray(values, dtype=float)
        except (TypeError, ValueError, OverflowError):
            raise ShapeError(argument, repr(values), f"{len(self)} numbers") from None
        if vector.shape != (len(self),):
            raise ShapeError(
                argument,
                f"shape {vector.shape}",
                f"shape ({len(self)},)",
                f"One value each for {', '.join(self.names)}.",
            )
        return vector.copy()

    def finite_vector(self, values: Values, argument: str, default: Array | None = None) -> Array:
        """Like `vector`, and NaN or infinity raises `ArgumentError`."""
        vector = self.vector(values, argument, default)
        for name, value in zip(self._units, vector.tolist(), strict=True):
            if not isfinite(value):
                raise ArgumentError(f"{argument}[{name!r}]", repr(value), "a finite number")
        return vector

    def _from_mapping(self, values: Mapping[str, Any], argument: str, default: Array | None) -> Array:
        missing = [name for name in self._units if name not in values]
        if default is None and missing:
            raise ArgumentError(argument, f"no value for {', '.join(missing)}", f"all of {', '.join(self.names)}")
        vector = np.zeros(len(self)) if default is None else default.astype(float)
        for name, value in values.items():
            i = self.index(name, argument)
            try:
                vector[i] = float(value)
            except (TypeError, ValueError, OverflowError):
                raise ShapeError(f"{argument}[{name!r}]", repr(value), "one number") from None
        return vector

    def __len__(self) -> int:
        return len(self._units)

    def __iter__(self) -> Iterator[str]:
        return iter(self._units)

    def __contains__(self, name: object) -> bool:
        return name in self._units

    def __repr__(self) -> str:
        return f"Signals({self._units!r}, role={self.role!r})"


class NamedSymbols:
    """A CasADi column vector whose entries answer to their names: `x.rate` or `x["rate"]`."""

    def __init__(self, signals: Signals, vector: Any) -> None:
        self._signals = signals
        self._vector = vector

    def __getitem__(self, name: str) -> Any:
        return self._vector[self._signals.index(name)]

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        if name not in self._signals:
            role = self._signals.role
            raise UnknownAttributeError(role, name, self._signals, f"Add it to the model's {role}, or correct it.")
        return self[name]


class NamedArray(Generic[T]):
    """An array whose last axis holds signals: `plan.u["torque"]`; numbers and slices index as usual.

    A signal's values are of type T: a float where the array is a vector, an array else.

    Parameters
    ----------
    signals : Signals
        The n signals of the last axis.
    values : ndarray, shape (..., n)
        The numbers.
    """

    def __init__(self, signals: Signals, values: Array) -> None:
        self.signals = signals
        self.values = values

    @overload
    def __getitem__(self, key: str) -> T: ...

    @overload
    def __getitem__(self, key: Any) -> Any: ...

    def __getitem__(self, key: Any) -> Any:
        if not isinstance(key, str):
            return self.values[key]
        return self.values[..., self.signals.index(key)][()]  # of a vector, a number

    def __len__(self) -> int:
        return len(self.values)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        return np.array(self.values, dtype=dtype, copy=True if copy is None else copy)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the array."""
        return self.values.shape

    def as_dict(self) -> dict[str, T]:
        """Each signal's values under its name."""
        return {name: self[name] for name in self.signals}

    def __repr__(self) -> str:
        return f"NamedArray({', '.join(self.signals.names)}; shape {self.shape})"
