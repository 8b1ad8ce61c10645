"""What Dask runs on workers: batches of tasks, by processes that stay from batch to batch."""

from __future__ import annotations

from collections import deque
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from threading import Lock, Thread
from time import monotonic, sleep
from typing import Any

from rumo.campaigns.tasks.supervised import ClosedError, Supervised
from rumo.campaigns.tasks.task import Row, Task
from rumo.errors import CampaignError
from rumo.version import __version__

IDLE = 60.0
"""How long a process waits for another batch [s]; the client may have gone."""

LONGEST = 10.0
"""After which a batch comes back with the rows that it has [s]: they are stored nowhere yet. The run that it is at was
thought to be far shorter, and is begun again in a batch of its own."""

REMEMBERED = 1000
"""Campaigns that have ended."""


class _OverdueError(Exception):
    """A batch has rows, and takes longer than it may."""


class Pool:
    """Processes by campaign, as many as batches were carried out at the same time."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._idle: dict[str, list[tuple[float, Supervised]]] = {}
        self._busy: dict[str, set[Supervised]] = {}
        # Batches of a campaign that has ended may still be about to begin.
        self._ended: deque[str] = deque(maxlen=REMEMBERED)
        self._sweeper: Thread | None = None

    def take(self, campaign: str, work: str, common: Mapping[str, Any]) -> Supervised:
        """One that nobody else has.

        Raises
        ------
        ClosedError
            If the campaign has ended.
        """
        with self._lock:
            if campaign in self._ended:
                raise ClosedError
            idle = self._idle.get(campaign)
            taken = idle.pop()[1] if idle else Supervised(work, common)
            self._busy.setdefault(campaign, set()).add(taken)
        return taken

    def give(self, campaign: str, taken: Supervised) -> None:
        """Back, for the next batch."""
        with self._lock:
            busy = self._busy.get(campaign)
            if busy is None or taken not in busy:
                return  # the campaign has ended, and this one with it
            busy.remove(taken)
            self._idle.setdefault(campaign, []).append((monotonic(), taken))
            if self._sweeper is None:
                self._sweeper = Thread(target=self._sweep, daemon=True)
                self._sweeper.start()

    @contextmanager
    def taken(self, campaign: str, work: str, common: Mapping[str, Any]) -> Generator[Supervised]:
        """One that nobody else has within the block."""
        process = self.take(campaign, work, common)
        try:
            yield process
        finally:
            self.give(campaign, process)

    def end(self, campaign: str) -> None:
        """End all processes of a campaign, also those that are at a run."""
        with self._lock:
            self._ended.append(campaign)
            ended = [*self._busy.pop(campaign, ()), *(process for _, process in self._idle.pop(campaign, ()))]
        for process in ended:
            process.close()

    def _sweep(self) -> None:
        """End processes that nobody has taken for long, until there are none."""
        while True:
            sleep(IDLE / 10)
            with self._lock:
                now, old = monotonic(), list[Supervised]()
                for campaign, idle in list(self._idle.items()):
                    old += [process for since, process in idle if now - since > IDLE]
                    self._idle[campaign] = [(since, process) for since, process in idle if now - since <= IDLE]
                    if not self._idle[campaign]:
                        del self._idle[campaign]
                    if not self._busy.get(campaign, True):
                        del self._busy[campaign]
                ended = not (self._idle or self._busy)
                if ended:
                    self._sweeper = None
            for process in old:
                process.close()
            if ended:
                return


_pool = Pool()


def carry_out_batch(
    version: str, campaign: str, work: str, common: Mapping[str, Any], tasks: Sequence[Task]
) -> tuple[list[Row], float]:
    """Rows of the first tasks, all or as many as there is time for, but one at least; and what they took [s].

    Parameters
    ----------
    version : str
        Of Rumo, where the campaign was started.
    campaign : str
        Whose processes to use.
    work, common, tasks
        See `Engine.rows`.
    """
    if version != __version__:
        raise CampaignError(f"a worker has Rumo {__version__}, the campaign Rumo {version}: install the same on both.")
    begun = monotonic()
    try:
        with _pool.taken(campaign, work, common) as process:
            rows = list[Row]()

            def require_time() -> None:
                if rows and monotonic() - begun > LONGEST:
                    raise _OverdueError

            try:
                for task in tasks:
                    require_time()
                    rows.append(process.run(task, require_time))
            except _OverdueError:
                pass
            except CampaignError:
                if not rows:  # else they come first, and the run that says so is the first of a batch soon
                    raise
            return rows, monotonic() - begun
    except ClosedError:
        return [], 0.0  # nobody waits for it any more


def end_campaign(campaign: str) -> None:
    """End the processes of a campaign in this worker."""
    _pool.end(campaign)
