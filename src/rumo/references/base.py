"""What a controller is asked to follow: signals and parameters along the horizon."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, TypeGuard, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import as_mapping, as_numbers, check_signature
from rumo.errors import ArgumentError, ShapeError
from rumo.signals import Array, NamedArray

if TYPE_CHECKING:
    from rumo.problem import Problem


@dataclass(frozen=True, eq=False)
class Preview:
    """What lies ahead. It has read-only arrays of its own.

    Attributes
    ----------
    signals : mapping of str to float or array_like (N + 1,)
        Wanted outputs, from now to the end of the horizon; a number is held.
    parameters : mapping of str to float or array_like (N,)
        Parameters of the controller's model on each interval: curvature, friction or wind ahead. Those not named are
        the controller's own.
    """

    signals: Mapping[str, ArrayLike]
    parameters: Mapping[str, ArrayLike] = field(default_factory=dict[str, ArrayLike])

    def __post_init__(self) -> None:
        for part, argument in (("signals", "reference"), ("parameters", "preview.parameters")):
            own = as_mapping(getattr(self, part), f"preview.{part}")
            for name, values in own.items():
                own[name] = array = as_numbers(values, f"{argument}[{name!r}]")  # a copy
                array.flags.writeable = False
            object.__setattr__(self, part, own)

    @classmethod
    def of_own(cls, signals: dict[str, Array], parameters: dict[str, Array]) -> Preview:
        """The same of arrays that nobody else has: neither checked nor copied."""
        preview = object.__new__(cls)
        for array in (*signals.values(), *parameters.values()):
            array.setflags(write=False)
        object.__setattr__(preview, "signals", signals)
        object.__setattr__(preview, "parameters", parameters)
        return preview


@runtime_checkable
class Reference(Protocol):
    """Anything that can say what lies ahead.

    One that remembers something from sample to sample, such as how far a vehicle is, has `start(problem)` besides,
    which returns what previews in one run: as an estimator, it is settings, and shared by runs.
    """

    def preview(self, times: Array, x: NamedArray[float]) -> Preview:
        """What lies ahead of a state.

        Parameters
        ----------
        times : ndarray, shape (N + 1,)
            Of the stages of the horizon [s]; the first is now.
        x : NamedArray, shape (nx,)
            Estimated state of the controller's model, now, or when it was last finite.
        """
        ...


SCALARS_ONLY = ("truth value", "converted to Python scalars")
"""Parts of what Python and NumPy say where an array should be a number."""
ARRAYS = "Write np.sin(t), not math.sin(t), and np.where(t < 1.0, a, b) for a condition: t is an array."

ReferenceLike = Reference | Callable[[Array], Mapping[str, Any]] | Mapping[str, float]
"""A reference, a function from times (n,) [s] to values (n,) of each signal, or numbers to be held."""


class OfTime(ABC):
    """A reference that follows the clock, wherever the system is: a function of times (n,) [s].

    Attributes
    ----------
    pointwise : bool
        Values (n,) at a time depend, to the last bit, on that time alone and not on the others it is asked for with:
        a closed loop asks such a reference for many samples at once.
    """

    pointwise: ClassVar[bool] = False

    @abstractmethod
    def __call__(self, t: Array) -> dict[str, Array]:
        """Values (n,) of each signal at times t (n,) [s]."""

    def preview(self, times: Array, x: NamedArray[float]) -> Preview:
        """Signals at these times, see `Reference`."""
        return Preview(self(times))


@dataclass(frozen=True)
class Held(OfTime):
    """Each signal at a value, always.

    Parameters
    ----------
    values : mapping of str to float
        In the signals' units.
    """

    pointwise: ClassVar[bool] = True

    values: Mapping[str, float]

    def __post_init__(self) -> None:
        values = as_mapping(self.values, "reference")
        for name, value in values.items():
            level = as_numbers(value, f"reference[{name!r}]")
            if level.ndim:
                raise ShapeError(
                    f"reference[{name!r}]", f"shape {level.shape}", "a number", "Give a function of times."
                )
            if not np.isfinite(level):
                raise ArgumentError(f"reference[{name!r}]", repr(value), "a finite number")
        object.__setattr__(self, "values", {name: float(value) for name, value in values.items()})

    def __call__(self, t: Array) -> dict[str, Array]:
        """Values at times t, see `OfTime`."""
        return {name: np.full(np.shape(t), value) for name, value in self.values.items()}


@dataclass(frozen=True)
class _Function(OfTime):
    """A user's function of times."""

    function: Callable[[Array], Mapping[str, Any]]
    argument: str

    def __call__(self, t: Array) -> dict[str, Array]:
        try:
            values = self.function(t)
        except (TypeError, ValueError) as error:
            if not any(part in str(error) for part in SCALARS_ONLY):
                raise
            got = f"one that takes single numbers only ({error})"
            raise ArgumentError(self.argument, got, "a function of an array of times", ARRAYS) from error
        return as_mapping(values, f"{self.argument}(t)")


def of_time(function: Callable[[Array], Mapping[str, Any]], argument: str) -> OfTime:
    """A user's function of times as a reference; one that is a reference already is returned."""
    if isinstance(function, OfTime):
        return function
    cure = "What depends on the state is an object with preview(times, x)."
    check_signature(function, argument, 1, "a function of times alone", cure)
    return _Function(function, argument)


def is_pointwise(reference: object) -> TypeGuard[OfTime]:
    """Whether a reference may be asked for many samples at once: see `OfTime.pointwise`.

    A class that previews or computes in another way than the one that is pointwise has to say so itself.
    """
    if not isinstance(reference, OfTime) or type(reference).preview is not OfTime.preview:
        return False
    computing = next(kind for kind in type(reference).__mro__ if "__call__" in vars(kind))
    return bool(vars(computing).get("pointwise", False))


def as_reference(reference: object) -> Reference:
    """`reference` as something to preview."""
    if isinstance(reference, Reference) and not isinstance(reference, type):
        return reference
    if isinstance(reference, Mapping):
        return Held(reference)
    if not callable(reference) or isinstance(reference, type):
        raise ArgumentError(
            "reference", repr(reference), "a function of times, or a mapping from names to numbers, or a Reference"
        )
    function: Any = reference
    return of_time(function, "reference")


def start_reference(reference: Reference, problem: Problem) -> Reference:
    """`reference` at the beginning of a run with a controller of `problem`, see `Reference`."""
    start = getattr(reference, "start", None)
    if not callable(start):
        return reference
    running = start(problem)
    if not isinstance(running, Reference):
        raise ArgumentError("reference.start()", repr(running), "something with preview(times, x)")
    return running
