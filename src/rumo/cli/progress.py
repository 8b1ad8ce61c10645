"""How far the work has come, on standard error: bars where a person watches, lines on a pipe, nothing if quiet."""

from __future__ import annotations

import logging
import sys
from collections.abc import Generator
from contextlib import contextmanager
from time import monotonic
from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from rumo.cli.console import standard_error

PAUSE = 10.0
"""Between two lines on a pipe about the same work [s]."""


class Told(Protocol):
    """Takes (name, how much of it is done, all of it)."""

    def __call__(self, name: str, done: float, every: int) -> None:
        """Show it."""
        ...


@contextmanager
def progress(quiet: bool = False) -> Generator[Told]:
    """What to tell progress to; what the package logs meanwhile is shown beside it."""
    with _quiet() if quiet else _bars() if sys.stderr.isatty() else _lines() as told:
        yield told


@contextmanager
def _quiet() -> Generator[Told]:
    with _messages(standard_error(), logging.WARNING):
        yield lambda name, done, every: None


@contextmanager
def _bars() -> Generator[Told]:
    console, tasks = standard_error(), dict[str, TaskID]()
    columns = TextColumn("{task.description:>15}"), BarColumn(), TextColumn("{task.fields[count]}"), TimeElapsedColumn()
    with Progress(*columns, console=console) as bars, _messages(console, logging.INFO):

        def tell(name: str, done: float, every: int) -> None:
            if name not in tasks:
                tasks[name] = bars.add_task(name, total=every, count="")
            bars.update(tasks[name], completed=done, total=every, count=f"{int(done)}/{every}")

        yield tell


@contextmanager
def _lines() -> Generator[Told]:
    console, started, shown = standard_error(), dict[str, float](), dict[str, float]()
    with _messages(console, logging.INFO):

        def tell(name: str, done: float, every: int) -> None:
            now = monotonic()
            begun = started.setdefault(name, now)
            if done < every and now - shown.get(name, -PAUSE) < PAUSE:
                return
            shown[name] = now
            so_far = f"{100.0 * done / every:.0f} %, {now - begun:.0f} s" if done else "started"
            console.print(f"{name}: {so_far}", soft_wrap=True, highlight=False)

        yield tell


class _Handler(logging.Handler):
    def __init__(self, console: Console, level: int) -> None:
        super().__init__(level)
        self._console = console

    def emit(self, record: logging.LogRecord) -> None:
        self._console.print(self.format(record), soft_wrap=True, highlight=False, markup=False)


@contextmanager
def _messages(console: Console, level: int) -> Generator[None]:
    """What the package says, above the bars."""
    logger, handler = logging.getLogger("rumo"), _Handler(console, level)
    before = logger.level, logger.propagate
    logger.addHandler(handler)
    logger.setLevel(level)
    logger.propagate = False
    try:
        yield
    finally:
        logger.removeHandler(handler)
        logger.setLevel(before[0])
        logger.propagate = before[1]
