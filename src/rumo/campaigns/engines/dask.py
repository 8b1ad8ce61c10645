"""Runs on the workers of a Dask cluster: one that exists, or one within this process, as wide as the machine."""

from __future__ import annotations

import logging
import os
import socket
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import suppress
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as version_of
from importlib.util import find_spec
from queue import Empty, SimpleQueue
from secrets import token_hex
from time import monotonic
from typing import Any

from rumo.campaigns.engines.batches import Batches
from rumo.campaigns.engines.on_worker import carry_out_batch, end_campaign
from rumo.campaigns.tasks.process import HEARTBEAT
from rumo.campaigns.tasks.rows import CRASHED, Attempt, complete_row
from rumo.campaigns.tasks.supervised import SUPERSEDED
from rumo.campaigns.tasks.task import Row, Task
from rumo.checks import whole_number
from rumo.errors import ArgumentError, CampaignError
from rumo.extras import required
from rumo.version import __version__

WINDOW = 6
"""Batches that are on their way, for each worker: enough that none waits, few enough for any number of tasks."""
PATIENCE = 15.0
"""How long to wait for a scheduler [s]."""
WORKER_PATIENCE = 60.0
"""How long to wait for the first worker [s]."""
PAUSE = 5.0
"""Between two looks at how many workers there are [s]."""

LOGS = ("distributed.admin.low-level-log-length", "distributed.admin.log-length")
KEPT = 50
"""Events that Dask remembers of the cluster within this process: each has the tasks of a batch."""


class DaskEngine:
    """Carries out tasks in batches on a Dask cluster, whose workers each look after a process for every thread.

    Parameters
    ----------
    scheduler : str or None
        Address of a scheduler, such as "tcp://host:8786"; None starts a cluster within this process, which needs no
        network.
    workers : int or None
        How many runs are made at the same time within this process; None for one a core.

    Raises
    ------
    ArgumentError
        If nobody answers at the address, no worker is there, or one has another version of Rumo; or if Dask is not
        installed.
    """

    def __init__(self, scheduler: str | None = None, workers: int | None = None) -> None:
        distributed = required("distributed", "campaign", "campaign")
        self._embedded = scheduler is None
        self._cluster: Any = None
        if scheduler is None:
            count = _cores() if workers is None else whole_number(workers, "workers", 1)
            _be_quiet()
            self._cluster = _embedded_cluster(distributed, count)
            self._client = distributed.Client(self._cluster, set_as_default=False)
        else:
            _be_quiet()
            self._client = _connected(distributed, scheduler)
        self._scheduler = scheduler or "this process"
        self._counted, self._workers = monotonic(), sum(self._client.nthreads().values())
        self._campaign, self._common = "", ("", dict[str, Any]())

    def __enter__(self) -> DaskEngine:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def workers(self) -> int:
        """How many runs are made at the same time: threads of all workers there are now."""
        if not self._embedded and monotonic() - self._counted > PAUSE:
            with suppress(Exception):  # what comes of it is for those to say who wait for rows
                self._workers = max(sum(self._client.nthreads().values()), 1)
            self._counted = monotonic()
        return self._workers

    @property
    def address(self) -> str | None:
        """Of Dask's page that shows what is going on; None where Bokeh, which draws it, is not installed."""
        return self._client.dashboard_link if find_spec("bokeh") else None

    def rows(
        self,
        work: str,
        common: Mapping[str, Any],
        tasks: Iterable[Task],
        meanwhile: Callable[[], object] | None = None,
    ) -> Generator[Row]:
        """See `Engine`."""
        if not self._campaign or self._common != (work, dict(common)):
            self._end_campaign()
            self._campaign, self._common = token_hex(8), (work, dict(common))
        campaign, batches = self._campaign, Batches(tasks)
        window = _Window(self._client, (__version__, self._campaign, work, dict(common)))
        try:
            while True:
                while len(window) < WINDOW * self.workers and (batch := batches.take(self.workers)):
                    window.send(batch)
                if not window:
                    return
                if self._campaign != campaign:
                    raise CampaignError(SUPERSEDED)
                rows, seconds, left = self._come_back(window, meanwhile)
                if seconds:
                    batches.learn(len(rows), seconds)
                batches.put_back(left)
                yield from rows
        finally:
            if window:  # runs are under way of which nobody will take the rows
                window.cancel()
                if self._campaign == campaign:
                    self._end_campaign()

    def close(self) -> None:
        """Leave the cluster; the one within this process ends."""
        self._end_campaign()
        with suppress(Exception):
            self._client.close()
        if self._cluster is not None:
            self._cluster.close()

    def _come_back(
        self, window: _Window, meanwhile: Callable[[], object] | None
    ) -> tuple[list[Row], float, Sequence[Task]]:
        """Rows of the next batch that is done, what they took [s], and those of its tasks that are not done."""
        from distributed import KilledWorker

        batch, future = window.next(lambda: self._client.status, meanwhile)
        if future is None or future.cancelled():
            raise CampaignError(
                f"the scheduler at {self._scheduler} has gone. Start one, and start the campaign again to go on."
            )
        error = future.exception()
        if error is None:
            rows, seconds = future.result()
            return rows, seconds, batch[len(rows) :]
        if isinstance(error, CampaignError):
            raise error
        if not isinstance(error, KilledWorker):  # of somebody who has come late, and whose packages are others
            words = " ".join(f"{type(error).__name__}: {error}".split())
            raise CampaignError(
                f"{self._scheduler} could not have runs carried out. {words.removesuffix('.')}. "
                f"Scheduler and workers need Rumo {__version__}; start again to go on."
            ) from error
        if len(batch) > 1:  # which of them it was is found by sending each alone
            for task in batch:
                window.send([task])
            return [], 0.0, []
        reason = "each worker that began this run ended"
        # When it began, and how long it took, was known to these workers alone.
        return [complete_row(batch[0], CRASHED, reason, {}, Attempt(None, None, error.allowed_failures + 1))], 0.0, []

    def _end_campaign(self) -> None:
        """End the processes of the latest campaign on all workers."""
        campaign, self._campaign = self._campaign, ""
        if not campaign:
            return
        if self._embedded:
            end_campaign(campaign)
            return
        with suppress(Exception):  # a worker that has gone has nothing to end; others do so when they were idle
            self._client.run(end_campaign, campaign, on_error="ignore")


class _Window:
    """Batches that are on their way."""

    def __init__(self, client: Any, begin: tuple[Any, ...]) -> None:
        self._client, self._begin = client, begin
        self._batches: dict[str, tuple[list[Task], Any]] = {}
        self._done = SimpleQueue[str]()
        self._name, self._number = f"rumo-{token_hex(8)}", 0

    def __len__(self) -> int:
        return len(self._batches)

    def send(self, batch: list[Task]) -> None:
        self._number += 1
        key = f"{self._name}-{self._number}"
        future = self._client.submit(carry_out_batch, *self._begin, batch, key=key, pure=False, priority=-self._number)
        self._batches[key] = batch, future
        future.add_done_callback(lambda done: self._done.put(done.key))

    def next(self, status: Callable[[], str], meanwhile: Callable[[], object] | None = None) -> tuple[list[Task], Any]:
        """The next batch that is done, with its future; None for that if the scheduler has gone."""
        while True:
            try:
                return self._batches.pop(self._done.get(timeout=HEARTBEAT))
            except Empty:
                if status() not in ("running", "connecting"):
                    return [], None
                if meanwhile is not None:
                    meanwhile()

    def cancel(self) -> None:
        with suppress(Exception):
            self._client.cancel([future for _, future in self._batches.values()], force=True)
        self._batches.clear()


def _embedded_cluster(distributed: Any, workers: int) -> Any:
    """Scheduler and worker as threads of this process, which speak to each other without a socket."""
    from dask.config import set as configured

    with configured(dict.fromkeys(LOGS, KEPT)):
        return distributed.LocalCluster(
            n_workers=1,
            threads_per_worker=workers,
            processes=False,
            memory_limit=0,
            dashboard_address="127.0.0.1:0",
            worker_dashboard_address="127.0.0.1:0",
            silence_logs=logging.CRITICAL,
        )


def _connected(distributed: Any, scheduler: str) -> Any:
    """A client of a scheduler that has a worker, with the same version of Rumo on all of them."""
    try:
        _knock(scheduler)
        client = distributed.Client(scheduler, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or str(error) or type(error).__name__
        raise ArgumentError(
            "scheduler",
            f"{scheduler!r}, where no scheduler answers ({reason})",
            "the address of one of Dask, such as tcp://host:8786",
            "Start one with dask scheduler, and workers with dask worker ADDRESS; or leave it out.",
        ) from None
    try:
        try:  # a scheduler reads what workers are sent
            _check_version(f"{scheduler!r}, a scheduler", client.run_on_scheduler(version_of, "rumo"))
        except PackageNotFoundError as error:
            _check_version(f"{scheduler!r}, a scheduler", error)
        client.wait_for_workers(1, timeout=WORKER_PATIENCE)
        for worker, version in client.run(version_of, "rumo", on_error="return").items():
            _check_version(f"a worker at {worker}", version)
    except TimeoutError:
        client.close()
        raise ArgumentError(
            "scheduler", f"{scheduler!r}, which has no workers", "one that has some", f"Start dask worker {scheduler}"
        ) from None
    except BaseException:
        client.close()
        raise
    return client


def _check_version(whose: str, version: str | Exception) -> None:
    if version != __version__:
        came = f"Rumo {version}" if isinstance(version, str) else f"no Rumo ({version})"
        raise ArgumentError(
            "scheduler",
            f"{whose} with {came}",
            f"Rumo {__version__}",
            "Install it where the scheduler and the workers are.",
        )


def _knock(address: str) -> None:
    """Whether there is somebody at all, before threads of Dask's wait for an answer; says why not.

    Raises
    ------
    OSError, ValueError, OverflowError
        If there is not.
    """
    protocol, _, place = address.rpartition("://")
    host, _, port = place.rpartition(":")
    if protocol in ("", "tcp", "tls"):
        with socket.create_connection((host.strip("[]"), int(port)), PATIENCE) as connection:
            # A scheduler speaks first; Dask would wait for ever for one that does not.
            if protocol != "tls" and not connection.recv(1):
                raise ConnectionError("it hung up")


def _be_quiet() -> None:
    """What Dask says of connections that end is said in words of ours, or of no interest."""
    for name in ("distributed", "bokeh", "tornado"):
        logging.getLogger(name).setLevel(logging.CRITICAL)


def _cores() -> int:
    """That this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
