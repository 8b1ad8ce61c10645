"""How long a process may be at something: it ends itself, and says where it was, also where Python gets no turn."""

from __future__ import annotations

import faulthandler
from collections.abc import Generator
from contextlib import contextmanager

FOREVER = 1e8
"""A time that nobody waits for [s]; the longest that timers take is not much longer."""

_running: list[float] = []


@contextmanager
def limited(seconds: float | None) -> Generator[None]:
    """End this process if the block takes longer [s]; None is for ever."""
    if seconds is None or seconds >= FOREVER:
        yield
        return
    # A thread of C, which needs no turn of Python's.
    faulthandler.dump_traceback_later(seconds, exit=True)
    _running.append(seconds)
    try:
        yield
    finally:
        _running.pop()
        faulthandler.cancel_dump_traceback_later()


@contextmanager
def unlimited() -> Generator[None]:
    """Within a block that is limited: let this take what it takes, and begin to count anew after it."""
    if not _running:
        yield
        return
    faulthandler.cancel_dump_traceback_later()
    try:
        yield
    finally:
        faulthandler.dump_traceback_later(_running[-1], exit=True)
