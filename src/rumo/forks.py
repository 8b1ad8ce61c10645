"""Locks of what threads share, in processes that fork: the child has the lock of a thread, but not the thread."""

from __future__ import annotations

import os
from collections.abc import Callable
from threading import RLock
from typing import Any
from weakref import WeakKeyDictionary

from rumo.errors import ForkedError

_shared: WeakKeyDictionary[Any, Callable[[Any], None]] = WeakKeyDictionary()


def when_forked(shared: Any, tell: Callable[[Any], None]) -> None:
    """Call `tell(shared)` in every child process that this one forks, as long as `shared` is there."""
    _shared[shared] = tell


def _tell_all() -> None:
    for shared, tell in list(_shared.items()):
        tell(shared)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_tell_all)


class SharedLock:
    """A reentrant lock that raises in a forked child, where waiting for its owner would have no end."""

    def __init__(self) -> None:
        self._lock, self._orphaned = RLock(), False
        when_forked(self, SharedLock._after_fork)

    def _after_fork(self) -> None:
        if self._lock.acquire(blocking=False):
            self._lock.release()
        else:
            self._orphaned = True

    def __enter__(self) -> None:
        if self._orphaned:
            raise ForkedError
        self._lock.acquire()

    def __exit__(self, *_: object) -> None:
        self._lock.release()
