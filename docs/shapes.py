"""Griffe extension: keep the shapes of arrays in docstrings as they are written.

Griffe reads the type "ndarray, shape (n,)" as Python and would print "(ndarray, shape(n))".
"""

from __future__ import annotations

import re
from typing import Any

from griffe import Extension, Object

# The line of a parameter: its names, " : ", a type, and then ", shape (n,)" or ", (n,)".
TYPE = re.compile(r"^(?P<names>\s*\w[\w, ]*) : (?P<type>[\w ]+), (?P<word>shapes? )?(?=\()", re.MULTILINE)


class Shapes(Extension):
    """Writes "ndarray of shape (n,)", which no one takes for an expression."""

    def on_object(self, *, obj: Object, **_: Any) -> None:
        """Change the docstring of an object before it is parsed."""
        if obj.docstring is not None:
            obj.docstring.value = TYPE.sub(
                lambda match: f"{match['names']} : {match['type']} of {match['word'] or 'shape '}", obj.docstring.value
            )
