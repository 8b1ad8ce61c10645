"""Ctrl-C ends a command after what is done has been written, whatever it came upon."""

from __future__ import annotations

import signal
from collections.abc import Generator
from contextlib import contextmanager
from types import FrameType


class Interrupts:
    """Whether SIGINT has come since `interrupts()`."""

    seen = False

    def check(self) -> None:
        """Raise `KeyboardInterrupt` if it has."""
        if self.seen:
            raise KeyboardInterrupt


@contextmanager
def interrupts() -> Generator[Interrupts]:
    """Raise `KeyboardInterrupt` on SIGINT, and remember that it came.

    Solvers and integrators that call back into Python may take the exception for a failure of their own and go on. What
    they return then is worth nothing: check before a result is used.
    """
    met = Interrupts()

    def interrupt(number: int, frame: FrameType | None) -> None:
        met.seen = True
        raise KeyboardInterrupt

    try:
        before = signal.signal(signal.SIGINT, interrupt)
    except ValueError:  # not in the main thread, where signals are others' business
        yield met
        return
    try:
        yield met
    finally:
        signal.signal(signal.SIGINT, before)
