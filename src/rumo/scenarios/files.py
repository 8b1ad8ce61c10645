"""Scenarios as TOML files: nested tables and dotted names are the same."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Collection, Iterable, Mapping
from math import isinf, isnan
from pathlib import Path
from typing import Any

from rumo.errors import ArgumentError, FileError
from rumo.scenarios.arguments import Plain
from rumo.scenarios.kinds import KIND, is_range


def read_tables(path: str | Path) -> dict[str, Any]:
    """Tables of a TOML file.

    Raises
    ------
    FileError
        If it is no TOML.
    ArgumentError
        If it cannot be read.
    """
    try:
        return tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except tomllib.TOMLDecodeError as error:
        line = re.search(r"at line (\d+)", str(error))
        raise FileError(path, int(line[1]) if line else None, str(error), "a TOML file") from None
    except UnicodeDecodeError as error:
        raise FileError(path, None, str(error), "a TOML file in UTF-8") from None
    except OSError as error:
        raise ArgumentError("file", f"'{path}' ({error.strerror})", "a TOML file that can be read") from None


def flattened(table: Mapping[str, Any], prefix: str = "") -> dict[str, Plain]:
    """Values by dotted names; a table with `kind`, or `from` and `to`, is a value.

    Raises
    ------
    ArgumentError
        If a table is empty, or a name has two values: as a dotted one, and in a table.
    """
    found: dict[str, Plain] = {}
    for key, value in table.items():
        name = f"{prefix}{key}"
        own: dict[str, Any] = {name: value}
        if isinstance(value, Mapping) and KIND not in value and not is_range(value):
            if not value:
                raise ArgumentError(name, "an empty table", "a value, or a table of values", "Or leave it out.")
            own = flattened(value, f"{name}.")
        require_once(own, found)
        found |= own
    return found


def require_once(names: Iterable[str], known: Collection[str]) -> None:
    """Raise if a setting is there already: TOML takes a dotted name in quotes for another one than that of tables."""
    for name in names:
        if name in known:
            raise ArgumentError(name, "two values", "one", "It is set by its dotted name and within a table.")


def line_of(path: str | Path, name: str) -> int | None:
    """Line in which a file sets a value, counted from 1; None if that cannot be told.

    Parameters
    ----------
    path : str or Path
        Of the file.
    name : str
        Dotted: tables, then the key.
    """
    try:
        lines = Path(path).read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        return None
    table = ""
    for number, line in enumerate(lines, 1):
        if header := re.match(r"\s*\[+\s*([^\]]+?)\s*\]", line):
            table = re.sub(r"[\"'\s]", "", header[1]) + "."
            if table == f"{name}.":
                return number
        elif key := re.match(r"\s*((?:\"[^\"]*\"|'[^']*'|[\w.\s-])+?)\s*=", line):
            full = table + re.sub(r"[\"'\s]", "", key[1])
            if name == full or name.startswith(f"{full}."):
                return number
    return None


def written(tables: Mapping[str, Mapping[str, Plain]]) -> str:
    """Tables as TOML, their values by quoted keys, what is None as "none"."""
    parts = [
        "\n".join([f"[{name}]", *(f"{_key(key)} = {_value(value)}" for key, value in table.items())])
        for name, table in tables.items()
    ]
    return "\n\n".join(parts) + "\n"


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _text(key)


def _value(value: Plain) -> str:
    if value is None:
        return '"none"'
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, float):
        if isnan(value) or isinf(value):
            return "nan" if isnan(value) else "inf" if value > 0.0 else "-inf"
        return repr(value)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(key)} = {_value(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list | tuple):
        return f"[{', '.join(_value(item) for item in value)}]"
    return str(value)


def _text(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else f"\\U{ord(c):08x}" for c in escaped) + '"'
