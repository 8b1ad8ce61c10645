"""What all studies have: runs that are plain data, and a report of what came of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Generator, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from signal import SIG_IGN, SIGINT, signal
from typing import Any, ClassVar, Protocol

from rumo.interrupts import interruptible
from rumo.report.contents import Report
from rumo.studies.sharing import shared_controller as shared_controller

Key = tuple[str | float, ...]
"""Says which run of a study: ("rti", "jump"). Its first part is what progress is told by."""

Progress = Callable[[str, float, int], None]
"""Called with (first part of the key, how many of its runs are done, all of them)."""


class Run(Protocol):
    """Something to do, as plain data that can be sent to another process: a `Scenario`, or what is made of some.

    It may have a `unit`, in which it tells its progress: the only run of a name is shown by it.
    """

    def run(self, *, progress: Callable[[int, int], None] | None = None) -> Any:
        """Do it, and return what came of it; `progress` is called with (done, all) on the way."""
        ...


class Study(ABC):
    """Settings of a study, which say what to run and how to report what came of it."""

    keeps_logs: ClassVar[bool] = False
    """Whether what comes of a run, a log or something with one, is worth a file."""
    takes_parts: ClassVar[bool] = False
    """Whether the log of a run that was broken off is something to report."""

    @abstractmethod
    def runs(self) -> Mapping[Key, Run]:
        """What there is to do; each run can be done by itself, anywhere."""

    @abstractmethod
    def summary(self, results: Mapping[Any, Any]) -> dict[str, Any]:
        """Content of `summary.json`, from what came of the runs, nested by the parts of their keys.

        Runs may be missing, such as those after an interruption: it is of the others.
        """

    @abstractmethod
    def report(self, results: Mapping[Any, Any]) -> Report:
        """The summary, and sentences, tables and figures of it and of what came of the runs."""

    def run(self, progress: Progress | None = None) -> dict[Any, Any]:
        """Do everything; what came of it, nested by the parts of the runs' keys: `results["rti"]["jump"]`."""
        return nested(dict(carry_out(self.runs(), progress)))


class Resumable(Study):
    """A study of so many runs that what comes of each is kept in a file at once; see `Ledger`."""

    @property
    @abstractmethod
    def same(self) -> dict[str, Any]:
        """What all runs have in common, as plain data: with others, what is in the file is of no use."""

    @abstractmethod
    def record(self, result: Any) -> dict[str, Any]:
        """What is kept of what came of a run, as plain data."""

    @abstractmethod
    def restored(self, record: Mapping[str, Any]) -> Any:
        """What came of a run, as far as it was kept."""


def carry_out(runs: Mapping[Key, Run], progress: Progress | None = None, jobs: int = 1) -> Generator[tuple[Key, Any]]:
    """Do the runs one after the other, or several at once in processes; yields each key with what came of it.

    On Ctrl-C what the run comes to is not yielded, whatever it has made of it.
    """
    if jobs > 1:
        yield from _in_processes(runs, progress, jobs)
        return
    every, done = Counter(str(key[0]) for key in runs), Counter[str]()
    for key, run in runs.items():
        name = str(key[0])
        told = _Told(progress, name, done[name], every[name], getattr(run, "unit", ""))
        with interruptible(0):
            told(0, 1)
            result = run.run(progress=told)
        done[name] += 1
        told.end()
        yield key, result


class _Told:
    """Tells how far the runs of a name have come; one alone by its own measure, if that has a unit."""

    def __init__(self, progress: Progress | None, name: str, before: int, every: int, unit: str) -> None:
        self._progress, self._name, self._before, self._every = progress, name, before, every
        self._alone, self._whole = bool(unit) and every == 1, 1
        if self._alone:
            self._name = f"{name} ({unit})"

    def __call__(self, part: int, whole: int) -> None:
        self._whole = whole
        if part < whole:
            self._tell(part / whole)

    def end(self) -> None:
        """One more run is done."""
        self._tell(1.0)

    def _tell(self, share: float) -> None:
        if self._progress is None:
            return
        if self._alone:
            self._progress(self._name, share * self._whole, self._whole)
        else:
            self._progress(self._name, self._before + share, self._every)


def _in_processes(runs: Mapping[Key, Run], progress: Progress | None, jobs: int) -> Generator[tuple[Key, Any]]:
    every, done = Counter(str(key[0]) for key in runs), Counter[str]()
    # Each process gets all runs at once: what they share, such as a problem and so a controller, they share there too.
    pool = ProcessPoolExecutor(min(jobs, len(runs) or 1), get_context("spawn"), _take, (dict(runs),))
    try:
        keys = {pool.submit(_do, key): key for key in runs}
        for future in as_completed(keys):
            key, name = keys[future], str(keys[future][0])
            result = future.result()
            done[name] += 1
            if progress is not None:
                progress(name, done[name], every[name])
            yield key, result
    finally:  # runs that have begun come to their end, others do not begin
        pool.shutdown(cancel_futures=True)


_taken: dict[Key, Run] = {}
"""Runs that a process is there for."""


def _take(runs: dict[Key, Run]) -> None:
    _taken.update(runs)
    signal(SIGINT, SIG_IGN)  # the process that has started this one stops it


def _do(key: Key) -> Any:
    return _taken[key].run()


def nested(results: Mapping[Key, Any]) -> dict[Any, Any]:
    """Results by key as a mapping of mappings, by the parts of the keys."""
    tree: dict[Any, Any] = {}
    for key, result in results.items():
        branch = tree
        for part in key[:-1]:
            branch = branch.setdefault(part, {})
        branch[key[-1]] = result
    return tree
