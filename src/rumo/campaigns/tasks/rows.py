"""Rows of a campaign: what the task decides, what came of it, and what else is known of the run."""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rumo.campaigns.tasks.task import Row, Task
from rumo.version import __version__

DONE, RAISED, CRASHED, TIMEOUT = OUTCOMES = ("done", "raised", "crashed", "timeout")
"""The run came to its end; it raised an exception; its process ended; its time was over."""


@dataclass(frozen=True)
class Attempt:
    """How a run was made: when it began (UTC, ISO 8601), what time it took [s], the number of this attempt.

    The first two are None where nobody is left who would know.
    """

    started: str | None
    seconds: float | None
    number: int


def complete_row(task: Task, outcome: str, error: str | None, found: Mapping[str, Any], attempt: Attempt) -> Row:
    """A row with all that is known of a run, `found` being what its work has returned."""
    settings = {f"setting.{name}": plain(value, name) for name, value in task["settings"].items()}
    around = {
        "run.wall_time_s": attempt.seconds,
        "run.host": platform.node(),
        "run.started": attempt.started,
        "run.rumo": __version__,
        "run.python": platform.python_version(),
    }
    decided = {"key": task["key"], "draw": task["draw"], "controller": task["controller"], "outcome": outcome}
    return {**around, **found, **decided, "error": error, "attempts": attempt.number, **settings}


def plain(value: Any, name: str) -> bool | int | float | str | bytes | None:
    """A value as a table keeps it; what is nested becomes JSON.

    Raises
    ------
    TypeError
        If it is no plain data; the message begins with `name`.
    """
    if value is None or type(value) in (bool, int, float, str, bytes):
        return value
    for kind in (bool, int, float, str, bytes):  # NumPy's floats and names of enums are some, and something more
        if isinstance(value, kind):
            return kind.__call__(value)
    if isinstance(value, (list, tuple, Mapping)):
        return json.dumps(value, sort_keys=True)
    if getattr(value, "shape", None) == () and hasattr(value, "item"):
        return plain(value.item(), name)
    raise TypeError(f"{name}: a row cannot keep {type(value).__name__}, only None, bool, int, float, str and bytes")
