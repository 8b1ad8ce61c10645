"""Objects that refuse attributes they do not know: a slip of the pen must not pass in silence."""

from __future__ import annotations

from collections.abc import Iterator
from functools import wraps
from typing import Any

from rumo.errors import UnknownAttributeError


class Sealed:
    """A base class whose instances, once constructed, take only attributes that they know.

    Known is what any `__init__` has set, what a class of the instance defines or annotates, and whatever begins with an
    underscore. So a subclass declares its attributes as usual; `controller.aplied = 1` raises `UnknownAttributeError`.
    """

    _constructed = False

    def __init_subclass__(cls, **arguments: Any) -> None:
        super().__init_subclass__(**arguments)
        if "__init__" not in vars(cls):
            return
        own: Any = cls.__init__

        @wraps(own)
        def init(self: Any, *arguments: Any, **named: Any) -> None:
            own(self, *arguments, **named)
            # Not before a subclass's __init__, which called this one, is through.
            self._constructed = type(self).__init__ is init

        cls.__init__ = init

    def __setattr__(self, name: str, value: Any) -> None:
        if self._constructed and not name.startswith("_") and not hasattr(type(self), name):
            known = set(self._known())
            if name not in known:
                raise UnknownAttributeError(type(self).__name__, name, sorted(known))
        super().__setattr__(name, value)

    def _known(self) -> Iterator[str]:
        """Public attributes of the instance and its classes."""
        spaces = (vars(self), *(space for kind in type(self).__mro__ for space in (vars(kind), _annotations(kind))))
        return (name for space in spaces for name in space if not name.startswith("_"))


def _annotations(kind: type) -> dict[str, Any]:
    return vars(kind).get("__annotations__", {})
