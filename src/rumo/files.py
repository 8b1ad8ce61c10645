"""Files that are whole or not there."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from errno import EIO
from pathlib import Path
from secrets import token_hex


def write_whole(path: str | Path, write: Callable[[Path], object], *, durable: bool = False) -> Path:
    """Write a file beside its place and move it there in one go: what is at `path` is the old file or the new one.

    Parameters
    ----------
    path : str or Path
        Where the file shall be; the folder must exist. A link stays one, to what is written.
    write : callable
        Writes a file to the path that it is given, with the same suffix.
    durable : bool
        Whether it is still there, and whole, after a power cut: this waits for the disk.

    Raises
    ------
    OSError
        If it cannot be written; its `filename` is `path`.
    """
    path = Path(path)
    # A name by chance, of a file that is not there until it is written: nothing is left if Ctrl-C comes before.
    place = Path(os.path.realpath(path))
    temporary = place.with_name(f".{token_hex(8)}{path.suffix}")
    try:
        write(temporary)
        if durable:
            _to_disk(temporary)
        os.replace(temporary, place)
        if durable:
            _to_disk(place.parent)
    except OSError as error:
        raise OSError(error.errno or EIO, error.strerror or str(error), str(path)) from error
    finally:
        with suppress(OSError):  # it has moved, or the error before says more
            temporary.unlink()
    return path


def _to_disk(path: Path) -> None:
    """Wait until a file, or what a folder lists, is on the disk. Windows opens no folders."""
    if os.name == "nt" and path.is_dir():
        return
    descriptor = os.open(path, os.O_RDWR if os.name == "nt" else os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
