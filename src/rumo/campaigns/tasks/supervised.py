"""Runs in a process that may crash or hang: each becomes a row, and the next one goes on."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from datetime import UTC, datetime
from threading import Lock
from time import monotonic
from typing import Any

from rumo.campaigns.tasks.process import DiedError, LateError, Process
from rumo.campaigns.tasks.rows import CRASHED, DONE, RAISED, TIMEOUT, Attempt, complete_row
from rumo.campaigns.tasks.task import Row, Task
from rumo.errors import CampaignError

ATTEMPTS = 2
"""How often a run is made that its process does not outlive."""
GRACE = 2.0
"""How long after its deadline [s] a process, which ends itself then and says where it was, is ended from outside."""
SLACK = 20.0
"""What preparing may take beyond the time of a run [s], but for compiling: modules are imported for the first time."""
PATIENCE = 900.0
"""How long a process may take until it is ready for its first run [s]: it may compile, and limits itself otherwise."""

SUPERSEDED = "no more runs are carried out: their engine was closed, or has begun another campaign."


class ClosedError(Exception):
    """A run was broken off since it is no more wanted."""


class Supervised:
    """A process that carries out tasks, one at a time, and is replaced where it crashes or hangs.

    A run that takes longer than its time becomes a row `timeout`. One at which the process ended is made again in a new
    process, once, and then becomes a row `crashed`; one that raised an exception becomes a row `raised` at once: it
    would do so again. The process uses one thread for linear algebra, and ends when this process does.

    Parameters
    ----------
    work : str
        "package.module:function", see `Engine.rows`.
    common : mapping
        What all tasks have in common; `timeout` [s].
    """

    def __init__(self, work: str, common: Mapping[str, Any]) -> None:
        self._work, self._common = work, dict(common)
        timeout = common.get("timeout")
        self._timeout = float("inf") if timeout is None else float(timeout)
        self._process: Process | None = None
        self._closed, self._lock = False, Lock()
        self._unprepared = 0

    def __enter__(self) -> Supervised:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def pid(self) -> int | None:
        """Of the process, if there is one."""
        return None if self._process is None else self._process.pid

    def run(self, task: Task, meanwhile: Callable[[], object] | None = None) -> Row:
        """Carry out a task, whatever happens.

        Parameters
        ----------
        task : Task
            What to do.
        meanwhile : callable, optional
            Called about once a second until it is done; what it raises breaks the run off.

        Raises
        ------
        CampaignError
            If the work cannot be loaded, or what it is made from has changed.
        ClosedError
            If another thread has called `close`.
        """
        for number in range(1, ATTEMPTS + 1):
            process = self._ready(meanwhile)
            started, begun = datetime.now(UTC).isoformat(timespec="milliseconds"), monotonic()
            found: Mapping[str, Any] = {}
            try:
                kind, *content = process.ask(task, self._timeout + GRACE, meanwhile)
            except (LateError, DiedError) as end:
                self._discard()
                seconds = monotonic() - begun
                overdue = isinstance(end, LateError) or seconds >= self._timeout
                outcome = TIMEOUT if overdue else CRASHED
                error = f"longer than {self._timeout:g} s\n{end.words}".rstrip() if overdue else str(end)
            except BaseException:
                self._give_up()
                raise
            else:
                if kind == "changed":
                    raise CampaignError(content[0])
                seconds, overdue = monotonic() - begun, False
                outcome, error, found = (DONE, None, content[0]) if kind == "row" else (RAISED, *content)
            if outcome != CRASHED or number == ATTEMPTS:
                return complete_row(task, outcome, error, found, Attempt(started, seconds, number))
        raise AssertionError("unreachable")

    def close(self) -> None:
        """End the process, also from another thread and while it is at a run."""
        with self._lock:
            self._closed = True
            process, self._process = self._process, None
        if process is not None:
            process.kill()

    def _discard(self) -> None:
        with self._lock:
            process, self._process = self._process, None
        if process is not None:
            process.kill()
        if self._closed:
            raise ClosedError

    def _give_up(self) -> None:
        """End a process of which nobody awaits the answer: it would be taken for that to the next question."""
        with suppress(ClosedError):
            self._discard()

    def _ready(self, meanwhile: Callable[[], object] | None) -> Process:
        """The process, prepared if it can be; another one if it has ended meanwhile."""
        if self._process is not None and self._process.alive:
            return self._process
        prepared = [self._timeout + SLACK] * (self._unprepared < ATTEMPTS)
        limits = [*prepared, *[None] * ATTEMPTS]
        for number, limit in enumerate(limits, 1):
            self._discard()
            begun = monotonic()
            with self._lock:
                if self._closed:
                    raise ClosedError
                process = self._process = Process()
            try:
                said, *why = process.ask((sys.path, self._work, self._common, limit), PATIENCE, meanwhile)
            except (LateError, DiedError) as end:
                if limit is not None:  # what hangs would do so again; what has ended it may have come from outside
                    hung = isinstance(end, LateError) or monotonic() - begun >= self._timeout
                    self._unprepared += ATTEMPTS if hung else 1
                if number == len(limits):
                    self._discard()
                    raise CampaignError(f"{self._work} cannot be loaded: its process ended. {end}".rstrip()) from None
                continue
            except BaseException:
                self._give_up()
                raise
            if said == "ready":
                return process
            self._discard()
            raise CampaignError(f"{self._work} cannot be loaded: {why[0]}")
        raise AssertionError("unreachable")
