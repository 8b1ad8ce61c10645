"""How far a campaign has come, on standard error: a bar where a person watches, a line a minute on a pipe."""

from __future__ import annotations

import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager
from time import monotonic

from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from rumo.campaigns.standing import Standing
from rumo.cli.console import standard_error

LINE_PAUSE = 60.0
"""Between two lines on a pipe [s]."""
BAR_PAUSE = 0.1
"""Between two looks of the bar [s]: rows may come by the thousand."""


@contextmanager
def campaign_progress(quiet: bool = False) -> Generator[Callable[[Standing], None]]:
    """What to tell a campaign's progress to."""
    with _silence() if quiet else _bar() if sys.stderr.isatty() else _lines() as tell:
        yield tell


@contextmanager
def _silence() -> Generator[Callable[[Standing], None]]:
    yield lambda standing: None


@contextmanager
def _bar() -> Generator[Callable[[Standing], None]]:
    columns = BarColumn(), TextColumn("{task.description}"), TimeElapsedColumn()
    with Progress(*columns, console=standard_error()) as bars:
        task: list[TaskID] = []
        due = _Due(BAR_PAUSE)

        def tell(standing: Standing) -> None:
            if not task:
                task.append(bars.add_task("", total=standing.every))
            if due(standing):
                bars.update(task[0], completed=standing.done, total=standing.every, description=str(standing))

        yield tell


@contextmanager
def _lines() -> Generator[Callable[[Standing], None]]:
    console, due = standard_error(), _Due(LINE_PAUSE)

    def tell(standing: Standing) -> None:
        if due(standing):
            console.print(str(standing), soft_wrap=True, highlight=False)

    yield tell


class _Due:
    """Whether it is time to show something: at the beginning, at the end, and after a pause."""

    def __init__(self, pause: float) -> None:
        self._pause, self._shown = pause, -pause

    def __call__(self, standing: Standing) -> bool:
        now = monotonic()
        if standing.done < standing.every and now - self._shown < self._pause:
            return False
        self._shown = now
        return True
