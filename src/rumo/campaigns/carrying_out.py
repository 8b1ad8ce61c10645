"""A campaign from its tasks to its rows: only what is missing is done, and what is done is kept."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import closing
from math import inf
from time import monotonic
from typing import Any

from rumo.campaigns.standing import Standing
from rumo.campaigns.store import Store
from rumo.campaigns.tasks.rows import DONE
from rumo.campaigns.tasks.task import Engine, Task
from rumo.errors import CampaignError
from rumo.interrupts import interruptible

Tell = Callable[[Standing], object]


def carry_out(
    work: str,
    common: Mapping[str, Any],
    tasks: Collection[Task],
    engine: Engine,
    store: Store,
    tell: Tell | None = None,
    *,
    retry_failed: bool = False,
    every: int | None = None,
    after: Standing | None = None,
) -> Standing:
    """Carry out those of a campaign's tasks of which the store has no rows, and store theirs as they come.

    Whatever ends it, rows that have come are stored. When all of the campaign are there, they are put into one file.

    Parameters
    ----------
    work, common
        See `Engine.rows`.
    tasks : collection of Task
        All of the campaign, which need not be in memory: a length, and an iterator each time it is asked for.
    engine : Engine
        Where they are carried out.
    store : Store
        Of this campaign.
    tell : callable, optional
        Called with a `Standing` at the beginning and after each row.
    retry_failed : bool
        Whether runs that raised, crashed or took too long are made again.
    every : int, optional
        How many tasks the campaign has of which these are the first; these are all if not given.
    after : Standing, optional
        Of the first tasks, if these have just been carried out.

    Returns
    -------
    Standing
        When all is done.

    Raises
    ------
    CampaignError
        If no more can be carried out, or stored.
    KeyboardInterrupt
        On Ctrl-C.
    """
    stored, begun = store.keys(failed=not retry_failed), monotonic()
    every = len(tasks) if every is None else every
    before = min(len(stored), every)  # there may have been more tasks
    # Those that failed among the first are there, unless they are made again.
    standing = Standing(every, before, before, 0 if after is None or retry_failed else after.failed, 0.0)
    if tell is not None:
        tell(standing)
    try:
        with closing(engine.rows(work, common, _Missing(tasks, stored, store), store.flush_in_time)) as rows:
            for row in rows:
                failed = standing.failed + (row["outcome"] != DONE)
                standing = Standing(standing.every, standing.before, standing.done + 1, failed, monotonic() - begun)
                store.add(row)
                if tell is not None:
                    tell(standing)
    except CampaignError as error:
        _flush(store, error)
        raise
    except BaseException:
        _flush(store, None)
        raise
    with interruptible(inf):
        store.flush() if len(tasks) < every else store.compact()
    return standing


class _Missing(Collection[Task]):
    """Tasks of which there are no rows; they bring no logs from when the store takes no more of these."""

    def __init__(self, tasks: Collection[Task], stored: set[str], store: Store) -> None:
        self._tasks, self._stored, self._store = tasks, stored, store

    def __len__(self) -> int:
        return max(len(self._tasks) - len(self._stored), 0)

    def __iter__(self) -> Iterator[Task]:
        for task in self._tasks:
            if task["key"] not in self._stored:
                yield task if self._store.takes_logs else {**task, "log": False}

    def __contains__(self, task: object) -> bool:
        return any(other == task for other in self)


def _flush(store: Store, error: CampaignError | None) -> None:
    """Store what is there. If that fails as well, the error before says more, but for one of something else."""
    with interruptible(inf):
        try:
            store.flush()
        except CampaignError:
            if error is None:
                raise
