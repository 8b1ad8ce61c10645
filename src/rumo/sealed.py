"""Objects that refuse attributes they do not know: a slip of the pen must not pass in silence."""

from __future__ import annotations

import inspect
import sys
from abc import ABCMeta
from collections.abc import Iterator
from typing import Any, TypeVar

from rumo.errors import FrozenError, UnknownAttributeError

T = TypeVar("T")


class _Sealing(ABCMeta):
    """Seals an instance when its construction is over, whoever wrote `__init__`."""

    def __call__(cls: type[T], *arguments: Any, **named: Any) -> T:
        made = type.__call__(cls, *arguments, **named)
        object.__setattr__(made, "_constructed", True)
        return made

    @property
    def __signature__(cls) -> inspect.Signature:
        """That of `__init__`, which `__call__` would hide."""
        own = inspect.signature(cls.__init__)
        return own.replace(parameters=list(own.parameters.values())[1:])


class Sealed(metaclass=_Sealing):
    """A base class whose instances, once constructed, take only attributes that they know.

    Known is what any `__init__` has set, what a class of the instance defines or annotates, and whatever begins with an
    underscore. So a subclass declares its attributes as usual; `controller.aplied = 1` raises `UnknownAttributeError`,
    and `controller.step = 1`, which would hide a method, `FrozenError`.
    """

    _constructed = False

    def __setattr__(self, name: str, value: Any) -> None:
        if self._constructed and not name.startswith("_"):
            own = next((vars(kind)[name] for kind in type(self).__mro__ if name in vars(kind)), None)
            if hasattr(own, "__get__") and not hasattr(own, "__set__"):
                raise FrozenError(f"{type(self).__name__}.{name} cannot be set. Define another one in a subclass.")
            known = set(self._known())
            if name not in known:
                raise UnknownAttributeError(type(self).__name__, name, sorted(known))
        super().__setattr__(name, value)

    def _known(self) -> Iterator[str]:
        """Public attributes of the instance and its classes."""
        spaces = (vars(self), *(space for kind in type(self).__mro__ for space in (vars(kind), _annotations(kind))))
        return (name for space in spaces for name in space if not name.startswith("_"))


def _annotations(kind: type) -> dict[str, Any]:
    if sys.version_info < (3, 14):
        return inspect.get_annotations(kind)
    from annotationlib import Format, get_annotations  # not there before

    return get_annotations(kind, format=Format.FORWARDREF)  # those for type checkers only have no value
