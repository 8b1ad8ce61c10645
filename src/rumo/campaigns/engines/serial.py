"""One run after the other, in a process beside this one."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Mapping
from typing import Any

from rumo.campaigns.tasks.supervised import SUPERSEDED, ClosedError, Supervised
from rumo.campaigns.tasks.task import Row, Task
from rumo.errors import CampaignError


class SerialEngine:
    """Carries out tasks in their order, one at a time; needs no further package."""

    workers = 1
    address: str | None = None

    def __init__(self) -> None:
        self._process: Supervised | None = None
        self._common = ("", dict[str, Any]())

    def __enter__(self) -> SerialEngine:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def rows(
        self,
        work: str,
        common: Mapping[str, Any],
        tasks: Iterable[Task],
        meanwhile: Callable[[], object] | None = None,
    ) -> Generator[Row]:
        """See `Engine`."""
        if self._process is None or self._common != (work, dict(common)):
            self.close()
            self._process, self._common = Supervised(work, common), (work, dict(common))
        process = self._process
        try:
            for task in tasks:
                yield process.run(task, meanwhile)
        except ClosedError:
            raise CampaignError(SUPERSEDED) from None

    def close(self) -> None:
        """End the process."""
        process, self._process = self._process, None
        if process is not None:
            process.close()
