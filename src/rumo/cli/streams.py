"""Standard output and standard error, which may be closed, full, or read by nobody."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from typing import TextIO


def open_closed() -> None:
    """Put nothing in the place of standard streams that are closed, as after `>&-`."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), "w", encoding="utf-8"))


def give_up(stream: TextIO) -> None:
    """Let a stream that cannot be written lead nowhere: Python would try, and complain, once more at its end."""
    with suppress(OSError, ValueError):  # a stream that is no file
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


class Unheeded:
    """Standard error for what is only told on the way: work does not end because nobody can hear of it."""

    def __init__(self) -> None:
        self._stream = sys.stderr

    @property
    def encoding(self) -> str:
        """Of the stream."""
        return self._stream.encoding

    def isatty(self) -> bool:
        """Whether a person watches."""
        return self._stream.isatty()

    def write(self, text: str, /) -> int:
        """Write, or forget."""
        try:
            self._stream.write(text)
        except (OSError, ValueError):
            give_up(self._stream)
        return len(text)

    def flush(self) -> None:
        """Have it written, or forgotten."""
        try:
            self._stream.flush()
        except (OSError, ValueError):
            give_up(self._stream)
