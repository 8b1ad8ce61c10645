"""Dataclasses of numbers in TOML files: a key for each field, a table for each that is a dataclass itself."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar, get_args, get_type_hints

from rumo.errors import ArgumentError, UnknownNameError
from rumo.files import write_whole

T = TypeVar("T")


def read_dataclass(kind: type[T], path: str | Path) -> T:
    """A dataclass from a file; raises an error with file and key if it cannot be made."""
    try:
        contents = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ArgumentError(str(path), str(error), "a TOML file with lines such as m = 1093.3") from None
    return _made(kind, contents, str(path), "")


def write_dataclass(value: Any, path: str | Path) -> None:
    """Write a dataclass to a file."""
    text = "\n".join(["# SI units", *_lines(value, "")]) + "\n"
    write_whole(path, lambda place: place.write_text(text, encoding="utf-8"))


def _made(kind: type[T], table: Mapping[str, Any], path: str, prefix: str) -> T:
    """The dataclass of a table, which is at `prefix` in the file."""
    kinds, given = get_type_hints(kind), dict[str, Any]()
    known = {item.name: item for item in fields(kind)}  # pyright: ignore[reportArgumentType]
    for key, value in table.items():
        if key not in known:
            raise UnknownNameError(f"{path}: {prefix}{key}", key, known)
        inner = next((option for option in (kinds[key], *get_args(kinds[key])) if is_dataclass(option)), None)
        if inner is None:
            given[key] = value
        elif isinstance(value, Mapping):
            given[key] = _made(inner, value, path, f"{prefix}{key}.")  # pyright: ignore[reportArgumentType]
        else:
            raise ArgumentError(f"{path}: {prefix}{key}", repr(value), "a table", f"Write [{prefix}{key}].")
    for name, item in known.items():
        if name not in given and item.default is MISSING and item.default_factory is MISSING:
            expected = f"all of {', '.join(_required(known.values()))}"
            raise ArgumentError(f"{path}: {prefix}{name}", "nothing", expected, "Add the missing ones to the file.")
    try:
        return kind(**given)
    except ArgumentError as error:
        name = error.argument.rpartition(".")[2]
        raise ArgumentError(f"{path}: {prefix}{name}", error.got, error.expected, error.cure) from None


def _required(items: Iterable[Any]) -> list[str]:
    return [item.name for item in items if item.default is MISSING and item.default_factory is MISSING]


def _lines(value: Any, prefix: str) -> list[str]:
    """Numbers first, then the tables, each under its name."""
    lines, tables = list[str](), list[str]()
    for item in fields(value):
        inner = getattr(value, item.name)
        if is_dataclass(inner):
            name = f"{prefix}{item.name}"
            tables += ["", f"[{name}]", *_lines(inner, f"{name}.")]
        elif inner is not None:
            lines.append(f"{item.name} = {float(inner)!r}")
    return lines + tables
