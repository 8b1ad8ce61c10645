"""One run after the other, in a process beside this one."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Mapping
from typing import Any

from rumo.campaigns.supervised import Supervised
from rumo.campaigns.task import Row, Task


class SerialEngine:
    """Carries out tasks in their order, one at a time; needs no further package."""

    workers = 1
    address: str | None = None

    def rows(self, work: str, common: Mapping[str, Any], tasks: Iterable[Task]) -> Generator[Row]:
        """See `Engine`."""
        with Supervised(work, common) as process:
            for task in tasks:
                yield process.run(task)

    def close(self) -> None:
        """Nothing is left to end."""
