"""Ctrl-C: kept while nothing may be broken off, then raised as what it is."""

from __future__ import annotations

import signal
import threading
from collections.abc import Generator
from contextlib import contextmanager
from types import FrameType
from typing import Any

EXIT_CODE = 130
"""Of all programs that SIGINT ends."""


class Interrupted(KeyboardInterrupt):
    """A simulation was interrupted; `log` holds the run up to that sample.

    Attributes
    ----------
    log : xarray.Dataset or None
        Everything recorded before.
    """

    def __init__(self, log: Any = None) -> None:
        super().__init__()
        self.log = log


@contextmanager
def interruptible(patience: float = 1) -> Generator[None, None, None]:
    """Make Ctrl-C within the block a KeyboardInterrupt at its end at the latest, whatever the block returned or raised.

    CasADi asks Python for signals while it computes. A KeyboardInterrupt then passes through SUNDIALS or IPOPT, which
    take it for a failure of the model, and comes out as a RuntimeError, as another error or not at all. So the signal
    is kept until the block ends. Who presses Ctrl-C twice is not made to wait.

    Signals reach the main thread alone: in others the block is left as it is, and so it is where the process does not
    handle Ctrl-C in Python.

    Parameters
    ----------
    patience : float
        How many signals are kept until the block ends; those after are raised at once. With 0 nothing waits, and what
        comes of the block is given up although something in it took the KeyboardInterrupt for an error of its own;
        with infinity nothing breaks the block off, which should be short.
    """
    handler = signal.getsignal(signal.SIGINT)
    if not callable(handler) or threading.current_thread() is not threading.main_thread():
        yield
        return
    kept: list[tuple[int, FrameType | None]] = []

    def keep(number: int, frame: FrameType | None) -> None:
        kept.append((number, frame))
        if len(kept) > patience:
            handler(number, frame)

    signal.signal(signal.SIGINT, keep)
    try:
        yield
    except KeyboardInterrupt:  # it is on its way, with what it brings
        kept.clear()
        raise
    finally:
        signal.signal(signal.SIGINT, handler)
        if kept:
            handler(*kept[0])
