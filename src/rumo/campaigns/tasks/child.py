"""The process that carries out runs for a `Supervised`: `python -m rumo.campaigns.tasks.child`.

It reads what to do from standard input and writes what came of it to standard output, before the first run for work,
then for each task. It is there to be killed: whatever happens to it costs one run.
"""

from __future__ import annotations

import faulthandler
import os
import signal
import sys
import traceback
from collections.abc import Callable, Mapping
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from typing import IO, Any

from rumo.campaigns.tasks.frames import receive, send
from rumo.campaigns.tasks.limits import limited
from rumo.campaigns.tasks.rows import plain
from rumo.campaigns.tasks.task import ChangedError, Task

LINES = 12
"""Of a traceback that are kept, the last ones."""
LONGEST = 2000
"""Characters of an error that are kept."""


Work = Callable[[Mapping[str, Any], Task], Mapping[str, Any]]


def main(lifeline: int | None = None) -> None:
    """See the module; on Linux, this process ends when the pipe `lifeline` has no writer any more."""
    requests, answers = _own_streams()
    faulthandler.enable()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process that has started this one ends it
    if lifeline is not None:
        _end_with(lifeline)
    _offer_to_be_killed_first()
    queue = SimpleQueue[Any]()
    Thread(target=_read, args=(requests, queue), daemon=True).start()
    path, name, common, preparation = queue.get()
    sys.path[:] = path
    try:
        work = _loaded(name)
    except BaseException as error:
        send(answers, ("failed", _in_words(error)))
        return
    if preparation is not None:
        _prepare(name, common, preparation)
    send(answers, ("ready",))
    while True:
        send(answers, _answer(work, common, queue.get()))


def _read(requests: IO[bytes], queue: SimpleQueue[Any]) -> None:
    """Take requests; when there can be no more, nobody waits for what this process is at."""
    while True:
        try:
            queue.put(receive(requests))
        except (EOFError, OSError):
            os._exit(0)


def _end_with(pipe: int) -> None:
    """Have the system end this process at a pipe's end, also while C code keeps Python's threads from running.

    Nothing must ever be written to that pipe. Linux can tie a process to its parent as well, but it takes the thread
    that has started it for the parent.
    """
    if sys.platform == "linux":
        import fcntl

        os.set_inheritable(pipe, False)
        signal.signal(signal.SIGIO, signal.SIG_DFL)
        fcntl.fcntl(pipe, fcntl.F_SETOWN, os.getpid())
        fcntl.fcntl(pipe, fcntl.F_SETFL, fcntl.fcntl(pipe, fcntl.F_GETFL) | os.O_ASYNC)


def _own_streams() -> tuple[IO[bytes], IO[bytes]]:
    """Standard input and output for this module alone: what others print goes to standard error."""
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    os.dup2(2, 1)
    return requests, answers


def _offer_to_be_killed_first() -> None:
    """Where memory runs out, the process with the results should not be the one to go."""
    with suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text("1000", encoding="ascii")


def _loaded(name: str) -> Work:
    module_name, _, function = name.partition(":")
    module = import_module(module_name)
    work: Work = getattr(module, function)
    if hasattr(module, "load"):
        module.load()
    return work


def _prepare(name: str, common: Mapping[str, Any], seconds: float) -> None:
    """Do what all runs share, if it can be done: each run without it says itself what is wrong."""
    module = import_module(name.partition(":")[0])
    if hasattr(module, "prepare"):
        with suppress(BaseException), limited(seconds):
            module.prepare(common)


def _answer(work: Work, common: Mapping[str, Any], task: Task) -> tuple[Any, ...]:
    """("row", columns), ("raised", in words, columns), or ("changed", in words)."""
    try:
        with limited(common.get("timeout")):
            try:
                return "row", _plain(work(common, task))
            except ChangedError as error:
                return "changed", str(error)
            except BaseException as error:
                found = getattr(error, "row", None)
                with suppress(Exception):
                    return "raised", _in_words(error), _plain(found or {})
                return "raised", _in_words(error), {}
    finally:
        for stream in (sys.stdout, sys.stderr):
            with suppress(Exception):
                stream.flush()


def _plain(row: Mapping[str, Any]) -> dict[str, Any]:
    return {name: plain(value, name) for name, value in row.items()}


def _in_words(error: BaseException) -> str:
    """Type and message, then where it was raised."""
    summary = "".join(traceback.format_exception_only(error)).strip()
    calls = [call for call in traceback.extract_tb(error.__traceback__) if call.filename != __file__]
    lines = "".join(traceback.format_list(calls)).rstrip().splitlines()[-LINES:]
    return "\n".join([summary[:LONGEST], *lines])[: 2 * LONGEST]


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
