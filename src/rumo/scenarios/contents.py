"""Files that decide a run: where they are does not matter, what is in them does."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path

from rumo.errors import ArgumentError
from rumo.scenarios.arguments import Plain


def digest(path: Path, argument: str = "base", expected: str = "a Python file that can be read") -> str:
    """SHA-256 of what a file holds.

    Raises
    ------
    ArgumentError
        If it cannot be read.
    """
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise ArgumentError(argument, f"'{path}' ({error.strerror})", expected) from None


def located(value: Plain, folder: Path) -> Plain:
    """A value that may name a file of a folder, or a list of such, with the whole path of each that is there."""
    if isinstance(value, list):
        return [located(item, folder) for item in value]
    if isinstance(value, str) and is_file(folder / value):
        return str((folder / value).resolve())
    return value


def files_in(value: Plain, digests: Mapping[str, str]) -> set[str]:
    """Those of a value, or of a list of values, that are known files."""
    if isinstance(value, list):
        return set[str]().union(*(files_in(item, digests) for item in value))
    return {value} if isinstance(value, str) and value in digests else set()


def by_content(value: Plain, digests: dict[str, str]) -> Plain:
    """A value, or a list of such, with what is in a file for its name.

    Parameters
    ----------
    value : plain data
        Of an argument that may name a file.
    digests : dict of str to str
        SHA-256 of files by their names, of those that are known; others are added.
    """
    if isinstance(value, list):
        return [by_content(item, digests) for item in value]
    if not isinstance(value, str):
        return value
    if value not in digests and is_file(Path(value)):
        digests[value] = digest(Path(value), "settings", "a file that can be read")
    return {"sha256": digests[value]} if value in digests else value


def is_file(path: Path) -> bool:
    """Whether there is such a file; texts that cannot be a path are none."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False
