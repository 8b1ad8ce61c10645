"""What a campaign costs beside its drives: time a run, memory, and what is lost against bare loops.

    python benchmarks/campaign.py overhead [--tasks 100000] [--file examples/campaign.toml]
    python benchmarks/campaign.py rate [--drives 60]
    python benchmarks/campaign.py scaling [--seconds 0.1]

`overhead`: tasks that do nothing, stored as rows, on the cluster within this process; memory of this process (client,
scheduler, store) and of the processes that carry out runs, as it grows; with a file, of the tasks of its campaign,
which is read and rehearsed before as its command does. `rate`: drives of the paper's car by the
campaign, in turns with as many processes that each do nothing else than a loop over their share. `scaling`: tasks that
sleep, on 1, 2, 4 and 8 workers, more than there are cores.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from statistics import median
from typing import Any

import psutil

from rumo.campaigns.carrying_out import carry_out
from rumo.campaigns.engines import DaskEngine
from rumo.campaigns.standing import Standing
from rumo.campaigns.store import Store
from rumo.campaigns.tasks.process import THREADS
from rumo.campaigns.tasks.task import Task

ROUNDS = 5


def main() -> None:
    """See the module."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    kinds = parser.add_subparsers(required=True, dest="kind")
    of_overhead = kinds.add_parser("overhead")
    of_overhead.add_argument("--tasks", type=int, default=100_000)
    of_overhead.add_argument("--file", type=Path)
    kinds.add_parser("rate").add_argument("--drives", type=int, default=60)
    kinds.add_parser("scaling").add_argument("--seconds", type=float, default=0.1)
    options = parser.parse_args()
    sys.path.insert(0, str(Path(__file__).parent))  # so that processes find the functions below
    {"overhead": overhead, "rate": rate, "scaling": scaling}[options.kind](options)


def nothing(common: Mapping[str, Any], task: Task) -> Mapping[str, Any]:
    """A run that takes no time, with as many columns as a drive has."""
    return {f"kpi.number_{i}": float(task["draw"] + i) for i in range(30)}


def with_rumo_loaded(common: Mapping[str, Any], task: Task) -> Mapping[str, Any]:
    """The same in a process that has driven."""
    if task["draw"] < 4:
        drive(common, task)
    return nothing(common, task)


def sleep(common: Mapping[str, Any], task: Task) -> Mapping[str, Any]:
    """A run that takes a while, and no processor."""
    time.sleep(common["seconds"])
    return {}


def drive(common: Mapping[str, Any], task: Task) -> Mapping[str, Any]:
    """The paper's drive with the real-time iteration and a seed of the task's."""
    from rumo.studies import PaperStudy

    (run,) = PaperStudy(controllers=("rti",), seed=task["draw"]).runs().values()
    return {"samples": run.run().sizes["time"]}


class Numbered:
    """Tasks that differ by their number."""

    def __init__(self, count: int) -> None:
        self._count = count

    def __len__(self) -> int:
        return self._count

    def __contains__(self, task: object) -> bool:
        return any(task == other for other in self)

    def __iter__(self) -> Iterator[Task]:
        return (
            {"key": f"{i:016x}", "draw": i, "controller": "rti", "settings": {"seed": i}} for i in range(self._count)
        )


def overhead(options: argparse.Namespace) -> None:
    """Time and memory with runs that do nothing."""
    own, shown = psutil.Process(), set[int]()

    def tell(standing: Standing) -> None:
        done = standing.done
        if done and done * 10 % standing.every == 0 and done not in shown:
            shown.add(done)
            processes = sorted(child.memory_info().rss / 1e6 for child in own.children())
            of_workers = ", ".join(f"{size:.0f}" for size in processes)
            print(f"{done:8} runs: {own.memory_info().rss / 1e6:.0f} MB here, {of_workers} MB in workers", flush=True)

    tasks: Any = Numbered(options.tasks) if options.file is None else _tasks_of(options.file, options.tasks)
    with tempfile.TemporaryDirectory() as folder, DaskEngine() as engine, Store(folder, {}) as store:
        begun = time.monotonic()
        last = carry_out("campaign:with_rumo_loaded", {}, tasks, engine, store, tell)
        print(f"{1e3 * last.seconds / options.tasks:.3f} ms a run with its row in a part, ", end="")
        print(f"{1e3 * (time.monotonic() - begun) / options.tasks:.3f} ms with all of them put into one")


def _tasks_of(file: Path, tasks: int) -> Any:
    """Tasks of a campaign, as many as that if there were so many runs."""
    from dataclasses import replace

    from rumo.campaigns.specification import Campaign

    campaign = Campaign.from_toml(file)
    return replace(campaign, runs=tasks // len(campaign.controllers)).tasks


def rate(options: argparse.Namespace) -> None:
    """Drives by a campaign and by bare loops, in turns."""
    shares: list[float] = []
    with DaskEngine() as engine:
        for number in range(ROUNDS + 1):
            found = {"bare": _bare_loops(engine.workers, options.drives), "campaign": _campaign(engine, options.drives)}
            if number:  # the first is there to fill caches
                shares.append(found["campaign"] / found["bare"])
                print(f"campaign {100 * shares[-1]:.1f} % of the bare loops' rate", flush=True)
    print(f"median of {ROUNDS}: {100 * median(shares):.1f} %")


def _campaign(engine: DaskEngine, drives: int) -> float:
    """Drives in a second, from when each worker has done one, and so imported and built what all need."""
    with tempfile.TemporaryDirectory() as folder, Store(folder, {}) as store:
        rows = engine.rows("campaign:drive", {}, Numbered(drives))
        for _ in range(engine.workers):
            store.add(next(rows))
        begun = time.monotonic()
        for row in rows:
            store.add(row)
        store.flush()
        return (drives - engine.workers) / (time.monotonic() - begun)


def _bare_loops(processes: int, drives: int) -> float:
    """Drives in a second of as many processes, each with its share, from when each has done one."""
    program = (
        "import sys; sys.path.insert(0, sys.argv[1]); from campaign import drive\n"
        "draws = range(*map(int, sys.argv[2:]))\n"
        "drive({}, {'draw': draws[0]}); print(flush=True); sys.stdin.readline()\n"
        "for draw in draws[1:]: drive({}, {'draw': draw})\n"
    )
    here, environment = str(Path(__file__).parent), os.environ | dict.fromkeys(THREADS, "1")
    loops = [
        subprocess.Popen(
            [sys.executable, "-c", program, here, *map(str, (first, drives, processes))],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for first in range(processes)
    ]
    for loop in loops:
        assert loop.stdout is not None
        loop.stdout.readline()
    begun = time.monotonic()
    for loop in loops:
        assert loop.stdin is not None
        loop.stdin.write("\n")
        loop.stdin.flush()
    for loop in loops:
        loop.wait()
    seconds = time.monotonic() - begun
    for loop in loops:
        loop.communicate()
    return (drives - processes) / seconds


def scaling(options: argparse.Namespace) -> None:
    """Runs that sleep, on more workers than there are cores."""
    for workers in (1, 2, 4, 8):
        with DaskEngine(workers=workers) as engine:
            rows = engine.rows("campaign:sleep", {"seconds": options.seconds}, Numbered(100 * workers))
            for _ in range(workers):
                next(rows)
            begun = time.monotonic()
            for _ in rows:
                pass
            ideal = 99 * options.seconds
            print(f"{workers} workers: {100 * ideal / (time.monotonic() - begun):.1f} % of what they could do at most")


if __name__ == "__main__":
    main()
