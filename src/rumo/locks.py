"""Locks between processes: a file that is locked as long as its process is alive, whatever ends it."""

from __future__ import annotations

import os
import sys
from collections.abc import Generator
from contextlib import contextmanager, suppress
from errno import ENOLCK, ENOSYS, ENOTSUP
from pathlib import Path
from time import monotonic, sleep

PAUSE = 0.05
"""Between two attempts [s]."""
OFFSET = 1 << 20
"""The byte that is locked on Windows, which lets nobody else read it: one beyond all that is written."""


@contextmanager
def locked(path: Path, patience: float) -> Generator[bool]:
    """Hold a lock within the block; the file is there only as long.

    Parameters
    ----------
    path : Path
        The lock's file, in a folder that exists. The holder may write to it.
    patience : float
        How long to wait for it [s].

    Yields
    ------
    bool
        Whether the lock is held: not if another process, or thread, has it all the time.

    Raises
    ------
    OSError
        If there can be no such file.
    """
    file, deadline = _try(path), monotonic() + patience
    while file is None and monotonic() < deadline:
        sleep(PAUSE)
        file = _try(path)
    try:
        yield file is not None
    finally:
        if file is not None:
            with suppress(OSError):  # Windows keeps files that are open
                path.unlink()
            os.close(file)


def _try(path: Path) -> int | None:
    """The file, locked; None if somebody else has it."""
    file = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
    try:
        # Who had it may have removed it after it was opened here: then this is the lock of nothing.
        if _lock(file) and (sys.platform == "win32" or _is_at(file, path)):
            return file
    except BaseException:
        os.close(file)
        raise
    os.close(file)
    return None


def _lock(file: int) -> bool:
    try:
        if sys.platform == "win32":
            import msvcrt

            os.lseek(file, OFFSET, os.SEEK_SET)
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        return False
    except OSError as error:  # a disk without locks, such as a cluster's: nobody is kept out
        if error.errno not in (ENOLCK, ENOSYS, ENOTSUP):
            raise
    return True


def _is_at(file: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(file), path.stat())
    except FileNotFoundError:
        return False
