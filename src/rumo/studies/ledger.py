"""What came of runs, in a file, line by line: a study that was interrupted goes on where it was."""

from __future__ import annotations

import json
from collections.abc import Mapping
from itertools import takewhile
from pathlib import Path
from typing import Any

from rumo.errors import ArgumentError
from rumo.studies.base import Key
from rumo.version import __version__


class Ledger:
    """A file of JSON lines: first what all runs have in common, then `{"key": [...], "outcome": {...}}` of each.

    A line that was not written to its end, or is damaged, is dropped with all that come after it.

    Parameters
    ----------
    path : Path
        Of the file.
    same : mapping
        What all runs have in common, plain data.
    resume : bool
        Go on with the file if there is one, else begin anew.

    Attributes
    ----------
    done : dict
        What came of the runs that are in the file, by key.

    Raises
    ------
    ArgumentError
        If the file is of other settings or another version.
    """

    def __init__(self, path: Path, same: Mapping[str, Any], *, resume: bool) -> None:
        self._path = path
        head = json.loads(json.dumps({**same, "rumo_version": __version__}))
        lines = path.read_bytes().splitlines(keepends=True) if resume and path.exists() else []
        contents = list(takewhile(bool, map(_content, lines)))
        lines = lines[: len(contents)] or [_line(head)]
        found, *entries = contents or [head]
        if found != head:
            other = next((name for name in head if found.get(name) != head[name]), "kind")
            raise ArgumentError(
                "--resume",
                f"{path} of another {other}",
                "results of the same settings and version",
                "Leave --resume out to begin anew, or name another folder.",
            )
        good = list(takewhile(lambda entry: entry.keys() == {"key", "outcome"}, entries))
        self.done: dict[Key, dict[str, Any]] = {tuple(entry["key"]): entry["outcome"] for entry in good}
        path.write_bytes(b"".join(lines[: 1 + len(good)]))

    def add(self, key: Key, outcome: Mapping[str, Any]) -> None:
        """One more run is done."""
        with self._path.open("ab") as file:
            file.write(_line({"key": list(key), "outcome": dict(outcome)}))


def _line(content: Mapping[str, Any]) -> bytes:
    return json.dumps(content, allow_nan=False).encode() + b"\n"


def _content(line: bytes) -> dict[str, Any]:
    """What a line says; nothing if it is not whole."""
    try:
        content = json.loads(line)
    except ValueError:
        return {}
    return content if isinstance(content, dict) and line.endswith(b"\n") else {}
