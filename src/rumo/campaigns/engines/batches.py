"""Tasks put into batches of a second or more: sending one is worth a millisecond, whatever is in it."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sized
from itertools import chain, islice
from math import ceil

from rumo.campaigns.tasks.task import Task

TARGET = 1.0
"""What a batch takes [s]."""
LARGEST = 200
"""Tasks of a batch."""
GROWTH = 4.0
"""Of batches, each time that one has come back."""
MEMORY = 0.3
"""Weight of the newest batch in what is known of a task's time."""


class Batches:
    """Takes tasks one batch after the other; their size follows from the time that others took.

    Parameters
    ----------
    tasks : iterable
        Read as batches are taken. Where its length is known, the last batches become smaller, so that workers end
        together.
    """

    def __init__(self, tasks: Iterable[Task]) -> None:
        self._left = len(tasks) if isinstance(tasks, Sized) else None
        self._returned = deque[Task]()
        self._tasks = iter(tasks)
        self._size, self._seconds = 1.0, 0.0

    def take(self, workers: int) -> list[Task]:
        """The next batch, of so many workers' work; empty if all tasks are taken."""
        size = int(self._size)
        if self._left is not None:
            size = min(size, max(ceil(self._left / (2 * workers)), 1))
        again = [self._returned.popleft() for _ in range(min(size, len(self._returned)))]
        batch = list(chain(again, islice(self._tasks, size - len(again))))
        if self._left is not None:
            self._left -= len(batch)
        return batch

    def put_back(self, tasks: Iterable[Task]) -> None:
        """Tasks that were taken, but not done: they are the next ones."""
        before = len(self._returned)
        self._returned.extend(tasks)
        if self._left is not None:
            self._left += len(self._returned) - before

    def learn(self, tasks: int, seconds: float) -> None:
        """So many tasks took so long."""
        newest = seconds / tasks
        self._seconds = newest if not self._seconds else (1.0 - MEMORY) * self._seconds + MEMORY * newest
        fitting = TARGET / max(self._seconds, TARGET / LARGEST)
        self._size = max(1.0, min(fitting, GROWTH * self._size))
