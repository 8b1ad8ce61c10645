"""What engines carry out: tasks, plain data, of which each becomes one row."""

from __future__ import annotations

import json
from collections.abc import Callable, Generator, Iterable, Mapping
from typing import Any, NotRequired, Protocol, TypedDict

from rumo.errors import ArgumentError

Plain = bool | int | float | str | list[Any] | dict[str, Any] | None
"""What a setting may be: data that JSON keeps."""

Row = dict[str, Any]
"""What came of a task, flat: column to None, bool, int, float or str; `log` to bytes of a NetCDF file."""


class ChangedError(ArgumentError):
    """What runs are made from is not what it was when the campaign began: those that remain cannot be made."""


class Task(TypedDict):
    """One run: `key` is the hash of all that it depends on; tasks of one `draw` differ by `controller` alone.

    `log` says that the row shall bring the run's log, or that it shall not, whatever came of it; `files`, the SHA-256
    of files that its settings name.
    """

    key: str
    draw: int
    controller: str
    settings: Mapping[str, Plain]
    log: NotRequired[bool]
    files: NotRequired[Mapping[str, str]]


class Engine(Protocol):
    """Carries out tasks, somewhere.

    Attributes
    ----------
    workers : int
        How many tasks are carried out at the same time; may change.
    address : str or None
        Where a browser shows what is going on, if anywhere.
    """

    @property
    def workers(self) -> int:
        """How many tasks are carried out at the same time; may change."""
        ...

    @property
    def address(self) -> str | None:
        """Where a browser shows what is going on, if anywhere."""
        ...

    def rows(
        self,
        work: str,
        common: Mapping[str, Any],
        tasks: Iterable[Task],
        meanwhile: Callable[[], object] | None = None,
    ) -> Generator[Row]:
        """Carry out tasks; the processes that do stay for further ones of the same work and `common`.

        Parameters
        ----------
        work : str
            "package.module:function", called as `function(common, task)` in a process of its own; it returns the row's
            columns besides those that the task decides. If the module has functions `load()` and `prepare(common)`,
            each new process calls them before its first run, outside of whose time this is. `load` has to succeed;
            where `prepare` raises, crashes or hangs, runs are made without it, and say themselves what is wrong.
        common : mapping
            What all tasks have in common, plain data. `timeout` [s], if it is there, is the time that a run may take.
        tasks : iterable
            May be longer than what memory holds: it is read as work goes on.
        meanwhile : callable, optional
            Called in the thread that asks for rows, about once a second while it waits for the next one. What it raises
            ends the work.

        Yields
        ------
        dict
            Exactly one row for each task, in any order, also for those that raise, crash or take too long.

        Raises
        ------
        CampaignError
            If nothing can be carried out, or no more: also where `function` raises `ChangedError`, or another campaign
            has begun meanwhile.
        """
        ...

    def close(self) -> None:
        """End all processes that this engine has started."""
        ...


def canonical(content: Any) -> str:
    """Plain data as a text, always the same."""
    return json.dumps(content, sort_keys=True, separators=(",", ":"))
