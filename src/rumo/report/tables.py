"""Tables, for terminal and page alike."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Table:
    """Heads and rows of text.

    Attributes
    ----------
    heads : list of str
        Of the columns; a line break is where a head may be broken.
    rows : list of list of str
        Cells.
    words : tuple of int
        Columns that hold words, which are aligned to the left; all others hold numbers. The first names the row.
    """

    heads: list[str]
    rows: list[list[str]]
    words: tuple[int, ...] = (0,)


def number(value: float | str | None) -> str:
    """A figure for readers: three significant digits, thousands separated, a dash for none."""
    if value is None:
        return "-"
    if isinstance(value, str):
        return value
    if isinstance(value, int) or 999.5 <= abs(value) < 1e7:
        return f"{value:,.0f}"
    return f"{value:#.3g}".rstrip(".")


def counts(numbers: Mapping[str, int]) -> str:
    """How many of each: "195 OPTIMAL, 5 BAD_MEASUREMENT"; no line is broken between a number and its name."""
    return ", ".join(f"{number(count)}\u00a0{name}" for name, count in numbers.items())
