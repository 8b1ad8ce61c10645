"""Objects that refuse attributes they do not know: a slip of the pen must not pass in silence."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Iterator
from functools import wraps
from typing import Any

from rumo.errors import FrozenError, UnknownAttributeError


class Sealed:
    """A base class whose instances, once constructed, take only attributes that they know.

    Known is what any `__init__` has set, what a class of the instance defines or annotates, and whatever begins with an
    underscore. So a subclass declares its attributes as usual; `controller.aplied = 1` raises `UnknownAttributeError`,
    and `controller.step = 1`, which would hide a method of the package, `FrozenError`.
    """

    _constructed = _constructing = False

    def __init_subclass__(cls, **arguments: Any) -> None:
        super().__init_subclass__(**arguments)
        own: Any = cls.__init__  # it may be that of another base

        @wraps(own)
        def init(self: Any, *arguments: Any, **named: Any) -> None:
            if self._constructing:  # by the __init__ of a subclass, which is not through
                return own(self, *arguments, **named)
            object.__setattr__(self, "_constructing", True)
            try:
                own(self, *arguments, **named)
            finally:
                object.__delattr__(self, "_constructing")
            object.__setattr__(self, "_constructed", True)

        cls.__init__ = init

    def __setattr__(self, name: str, value: Any) -> None:
        if self._constructed and not name.startswith("_"):
            kind = next((kind for kind in type(self).__mro__ if name in vars(kind)), None)
            if kind is not None:
                own = vars(kind)[name]
                if kind.__module__.startswith("rumo.") and inspect.isroutine(own):
                    raise FrozenError(f"{type(self).__name__}.{name} cannot be set. Define another one in a subclass.")
                if isinstance(own, property) and own.fset is None:
                    raise FrozenError(f"{type(self).__name__}.{name} cannot be set.")
            elif name not in (known := set(self._known())):
                raise UnknownAttributeError(type(self).__name__, name, sorted(known))
        super().__setattr__(name, value)

    def __delattr__(self, name: str) -> None:
        if self._constructed and not name.startswith("_"):
            raise FrozenError(f"{type(self).__name__}.{name} cannot be deleted.")
        super().__delattr__(name)

    def _known(self) -> Iterator[str]:
        """Public attributes of the instance and its classes."""
        spaces = (vars(self), *(space for kind in type(self).__mro__ for space in (vars(kind), _annotations(kind))))
        return (name for space in spaces for name in space if not name.startswith("_"))


def _annotations(kind: type) -> dict[str, Any]:
    if sys.version_info < (3, 14):
        return inspect.get_annotations(kind)
    from annotationlib import Format, get_annotations  # not there before

    return get_annotations(kind, format=Format.FORWARDREF)  # those for type checkers only have no value
