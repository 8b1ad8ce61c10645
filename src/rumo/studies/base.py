"""What all studies have: runs that are plain data, and a report of what came of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Generator, Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any, Protocol

from rumo.report.contents import Report

if TYPE_CHECKING:
    import xarray as xr

Key = tuple[str | float, ...]
"""Says which run of a study: ("rti", "jump"). Its first part is what progress is told by."""

Progress = Callable[[str, float, int], None]
"""Called with (first part of the key, how many of its runs are done, all of them)."""


class Run(Protocol):
    """Something to do, as plain data that can be sent to another process."""

    def __call__(self, progress: Callable[[int, int], None] | None = None) -> Any:
        """Do it, and return what came of it; `progress` is called with (done, all) on the way."""
        ...


class Study(ABC):
    """Settings of a study, which say what to run and how to report what came of it."""

    @abstractmethod
    def runs(self) -> Mapping[Key, Run]:
        """What there is to do; each run can be done by itself, anywhere."""

    @abstractmethod
    def report(self, results: Mapping[Any, Any]) -> Report:
        """Summary, sentences, tables and figures of what came of the runs, nested by the parts of their keys.

        Runs may be missing, such as those after an interruption: the report is of the others.
        """

    def log(self, result: Any) -> xr.Dataset | None:
        """The log of a run that is worth a file; None by default."""
        return None

    def __getstate__(self) -> dict[str, Any]:
        """The settings; what runs have built and share is built again where they are sent."""
        return {field.name: getattr(self, field.name) for field in fields(self)}  # pyright: ignore[reportArgumentType]

    def run(self, progress: Progress | None = None) -> dict[Any, Any]:
        """Do everything; what came of it, nested by the parts of the runs' keys: `results["rti"]["jump"]`."""
        return nested(dict(carry_out(self.runs(), progress)))


def carry_out(runs: Mapping[Key, Run], progress: Progress | None = None) -> Generator[tuple[Key, Any]]:
    """Do the runs one after the other; yields each key with what came of it."""
    every, done = Counter(str(key[0]) for key in runs), Counter[str]()
    for key, run in runs.items():
        name = str(key[0])

        def tell(part: int, whole: int, name: str = name) -> None:
            if progress is not None and part < whole:
                progress(name, done[name] + part / whole, every[name])

        tell(0, 1)
        result = run(tell)
        done[name] += 1
        if progress is not None:
            progress(name, done[name], every[name])
        yield key, result


def nested(results: Mapping[Key, Any]) -> dict[Any, Any]:
    """Results by key as a mapping of mappings, by the parts of the keys."""
    tree: dict[Any, Any] = {}
    for key, result in results.items():
        branch = tree
        for part in key[:-1]:
            branch = branch.setdefault(part, {})
        branch[key[-1]] = result
    return tree
