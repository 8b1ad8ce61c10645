"""Tables as text: columns with names, separated by commas, semicolons, tabs or blanks."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path as FilePath

import numpy as np

from rumo.errors import FileError
from rumo.signals import Array

COLUMNS = {
    "x": ("x", "pos_x", "p_x", "position_x", "x_ref", "east", "easting"),
    "y": ("y", "pos_y", "p_y", "position_y", "y_ref", "north", "northing"),
    "left": ("w_tr_left", "width_left", "w_left", "left", "left_width"),
    "right": ("w_tr_right", "width_right", "w_right", "right", "right_width"),
    "speed": ("vx", "v_x", "v", "speed", "velocity", "vel"),
}
"""What columns are for, by names without units: `x_m`, `X [m]` and `x (m)` are all x."""
UNITS = re.compile(r"\s*[\[(].*[\])]$|_(m|mps|mps2|rad|radpm)$")
DELIMITERS = (";", ",", "\t")
EXAMPLE = "x_m,y_m,w_tr_right_m,w_tr_left_m"


@dataclass(frozen=True)
class Table:
    """Columns (n,) by what they are for, and the line (n,) that each row stands in."""

    file: str
    columns: dict[str, Array]
    lines: list[int]

    def error(self, row: int, got: str, expected: str, cure: str = "") -> FileError:
        """What is wrong in a row."""
        return FileError(self.file, self.lines[row], got, expected, cure)


def text_of(file: str | FilePath) -> str:
    """A file's text.

    Raises
    ------
    FileError
        If it is no UTF-8.
    OSError
        If it cannot be read.
    """
    data = FilePath(file).read_bytes()
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        got = f"the byte 0x{data[error.start]:02x}"
        raise FileError(file, line, got, "text in UTF-8", "Save it as UTF-8; a binary file is no table.") from None


def read_table(file: str | FilePath) -> Table:
    """A table whose header is its first line, or the last line of those that begin with #.

    Raises
    ------
    FileError
        If there is no header with x and y, a row has other columns, or a value is no finite number.
    """
    name, header, rows, lines = str(file), None, list[list[str]](), list[int]()
    delimiter: str | None = None
    for number, raw in enumerate(text_of(file).split("\n"), 1):
        line = raw.strip()
        comment = line.startswith("#")
        if comment:
            line = line.lstrip("#").strip()
        if not line or (comment and rows):
            continue
        if comment or header is None:
            names, delimiter = _split(line)
            header = (number, names) if not comment or _known(names) else header
            continue
        fields = _fields(line, delimiter)
        if len(fields) != len(header[1]):
            got = f"{len(fields)} value{'s' * (len(fields) != 1)}"
            cure = f"The columns are {', '.join(header[1])}."
            raise FileError(name, number, got, f"{len(header[1])}, as the header has", cure)
        rows.append(fields)
        lines.append(number)
    if header is None:
        raise FileError(name, None, "nothing but comments" if lines else "no table", f"a header such as {EXAMPLE}")
    places = _places(name, *header)
    if not rows:
        raise FileError(name, None, "a header without rows", "points below it")
    columns = {
        use: np.array([_number(name, n, row[i]) for n, row in zip(lines, rows, strict=True)])
        for use, i in places.items()
    }
    return Table(name, columns, lines)


def _split(line: str) -> tuple[list[str], str | None]:
    """Names of a header, and what is between them."""
    delimiter = next((mark for mark in DELIMITERS if mark in line), None)
    return _fields(line, delimiter), delimiter


def _fields(line: str, delimiter: str | None) -> list[str]:
    return [field.strip().strip('"') for field in line.split(delimiter)]


def _plain(name: str) -> str:
    return UNITS.sub("", name.strip().lower())


def _known(names: list[str]) -> bool:
    """Whether a comment is a header."""
    return sum(_use(name) is not None for name in names) >= 2


def _use(name: str) -> str | None:
    """What a column is for."""
    return next((use for use, known in COLUMNS.items() if _plain(name) in known), None)


def _places(file: str, line: int, names: list[str]) -> dict[str, int]:
    """Which column is for what."""
    places: dict[str, int] = {}
    for i, name in enumerate(names):
        use = _use(name)
        if use in places:
            raise FileError(file, line, f"two columns for {use}: {names[places[use]]} and {name}", "one")
        if use is not None:
            places[use] = i
    for use in ("x", "y"):
        if use not in places:
            got = f"columns {', '.join(names)}"
            cure = f"Name the columns in the first line, such as {EXAMPLE}."
            raise FileError(file, line, got, f"one for {use}", cure)
    return places


def _number(file: str, line: int, field: str) -> float:
    try:
        value = float(field)
    except ValueError:
        cure = "Write numbers with a point, 1.5." if re.fullmatch(r"-?\d+,\d+", field) else ""
        raise FileError(file, line, repr(field), "a number", cure) from None
    if not np.isfinite(value):
        raise FileError(file, line, field, "a finite number", "Fill the gap or leave the line out.")
    return value
