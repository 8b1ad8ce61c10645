"""Ctrl-C: kept while nothing may be broken off, then raised as what it is."""

from __future__ import annotations

import signal
import threading
from contextlib import ContextDecorator
from importlib import import_module
from sys import builtin_module_names
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


# Without what Python's own module puts around them, enumerations for numbers, which take longer than many a block.
_signal: Any = import_module("_signal" if "_signal" in builtin_module_names else "signal")
_INTERRUPT = int(signal.SIGINT)


class interruptible(ContextDecorator):  # noqa: N801 -- used as a function
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

    def __init__(self, patience: float = 1) -> None:
        self._patience = patience
        self._handler: Any = None
        self._kept: list[tuple[int, FrameType | None]] = []

    def _recreate_cm(self) -> interruptible:
        """Another one for each call of a function that it decorates."""
        return interruptible(self._patience)

    def __enter__(self) -> None:
        handler = _signal.getsignal(_INTERRUPT)
        if callable(handler) and threading.current_thread() is threading.main_thread():
            self._handler = handler
            try:
                _signal.signal(_INTERRUPT, self._keep)
            except BaseException:  # of a signal that came in the meantime
                _signal.signal(_INTERRUPT, handler)
                raise

    def __exit__(self, kind: type[BaseException] | None, error: object, trace: object) -> None:
        if self._handler is None:
            return
        _signal.signal(_INTERRUPT, self._handler)
        # A KeyboardInterrupt is on its way already, with what it brings.
        if self._kept and not (kind is not None and issubclass(kind, KeyboardInterrupt)):
            self._handler(*self._kept[0])

    def _keep(self, number: int, frame: FrameType | None) -> None:
        self._kept.append((number, frame))
        if len(self._kept) > self._patience:
            self._handler(number, frame)
