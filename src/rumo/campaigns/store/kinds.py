"""Types of a table's columns: one for all its rows, whichever came first, and whichever file they are in."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from rumo.checks import as_float

Kind = str
"""Of a column: "null", "bool", "int64", "double" or "string", as Arrow writes them."""

HEAD = ("key", "draw", "controller", "outcome", "error", "attempts", "ended")
"""Columns that come first; then those that begin with these, each by name, then all others."""
GROUPS = ("setting.", "kpi.", "status.")
LARGEST = 2**63
"""Whole numbers from here on are no 64-bit integers."""
EXACT = 2**53
"""Whole numbers up to here are floats as well."""


def kind_of(value: Any, column: str) -> Kind:
    """Of one value: figures of merit are numbers with a fraction, also where they happen to be whole."""
    if value is None:
        return "null"
    if isinstance(value, (bool, int, float)) and column.startswith("kpi."):
        return "double"
    if isinstance(value, bool):
        return "bool"
    if isinstance(value, int):
        return "int64" if -LARGEST <= value < LARGEST else "string"
    return "double" if isinstance(value, float) else "string"


def common_kind(kinds: Iterable[Kind]) -> Kind:
    """The kind that holds values of all of these; the order does not matter."""
    found = set(kinds) - {"null"}
    if len(found) <= 1:
        return next(iter(found), "null")
    return "double" if found == {"int64", "double"} else "string"


def converted(value: Any, kind: Kind) -> Any:
    """A value as a column of that kind has it: texts are the same whichever kinds the value had before."""
    if value is None or kind == "null":
        return None
    if kind == "string":
        return _text(value)
    return {"bool": bool, "int64": int, "double": as_float}[kind](value)


def in_order(columns: Iterable[str]) -> list[str]:
    """Names of columns in the order of a table, which depends on them alone."""
    heads: Mapping[str, int] = {name: i for i, name in enumerate(HEAD)}

    def place(name: str) -> tuple[int, int, str]:
        if name in heads:
            return 0, heads[name], name
        group = next((i for i, prefix in enumerate(GROUPS) if name.startswith(prefix)), len(GROUPS))
        return 1, group, name

    return sorted(set(columns), key=place)


def _text(value: Any) -> str:
    if isinstance(value, int) and abs(value) >= EXACT and -LARGEST <= value < LARGEST:
        value = float(value)  # as which another part may have had it
    if isinstance(value, float) and value.is_integer() and abs(value) < EXACT:
        value = int(value)
    return str(value)
