"""The process that carries out runs for a `Supervised`: `python -m rumo.campaigns.child`.

It reads what to do from standard input and writes what came of it to standard output, before the first run for work,
then for each task. It is there to be killed: whatever happens to it costs one run.
"""

from __future__ import annotations

import faulthandler
import os
import signal
import sys
import traceback
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from typing import Any, BinaryIO

from rumo.campaigns.frames import receive, send
from rumo.campaigns.rows import plain
from rumo.campaigns.task import Task

LINES = 12
"""Of a traceback that are kept, the last ones."""
LONGEST = 2000
"""Characters of an error that are kept."""

FOREVER = 1e8
"""A time that nobody waits for [s]; the longest that timers take is not much longer."""

Work = Callable[[Mapping[str, Any], Task], Mapping[str, Any]]


def main() -> None:
    """See the module."""
    requests, answers = _own_streams()
    faulthandler.enable()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process that has started this one ends it
    _offer_to_be_killed_first()
    lifeline = Lifeline(requests)
    path, name, common = lifeline.next()
    sys.path[:] = path
    try:
        with lifeline.held():
            work = _prepared(name, common)
    except BaseException as error:
        send(answers, ("failed", _in_words(error)))
        return
    send(answers, ("ready",))
    while True:
        task = lifeline.next()
        with lifeline.held():
            answer = _answer(work, common, task)
        send(answers, answer)


class Lifeline:
    """Requests from the process that this one works for; when that has gone, this one ends, whatever it is at.

    Parameters
    ----------
    requests : file
        A pipe, which nobody else reads.
    """

    def __init__(self, requests: BinaryIO) -> None:
        self._requests, self._queue = requests, SimpleQueue[Any]()
        Thread(target=self._read, daemon=True).start()

    def next(self) -> Any:
        """Wait for a request."""
        return self._queue.get()

    @contextmanager
    def held(self) -> Generator[None]:
        """Within, C code may keep Python's threads from running: Linux ends this process when the pipe has an end.

        It would also do so if a request came.
        """
        self._signal(True)
        try:
            yield
        finally:
            self._signal(False)

    def _read(self) -> None:
        while True:
            try:
                self._queue.put(receive(self._requests))
            except (EOFError, OSError):
                os._exit(0)

    def _signal(self, wanted: bool) -> None:
        if sys.platform == "linux":
            import fcntl

            file = self._requests.fileno()
            flags = fcntl.fcntl(file, fcntl.F_GETFL) & ~os.O_ASYNC
            fcntl.fcntl(file, fcntl.F_SETOWN, os.getpid())
            fcntl.fcntl(file, fcntl.F_SETFL, flags | os.O_ASYNC if wanted else flags)


def _own_streams() -> tuple[BinaryIO, BinaryIO]:
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


def _prepared(name: str, common: Mapping[str, Any]) -> Work:
    module_name, _, function = name.partition(":")
    module = import_module(module_name)
    work: Work = getattr(module, function)
    if hasattr(module, "prepare"):
        module.prepare(common)
    return work


def _answer(work: Work, common: Mapping[str, Any], task: Task) -> tuple[Any, ...]:
    """("row", columns) or ("raised", in words, columns)."""
    timeout = common.get("timeout")
    if timeout is not None and timeout < FOREVER:
        # A thread of C, which needs no turn of Python's: it says where the run was, then ends this process.
        faulthandler.dump_traceback_later(timeout, exit=True)
    try:
        return "row", _plain(work(common, task))
    except BaseException as error:
        found = getattr(error, "row", None)
        with suppress(Exception):
            return "raised", _in_words(error), _plain(found or {})
        return "raised", _in_words(error), {}
    finally:
        faulthandler.cancel_dump_traceback_later()
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
    main()
