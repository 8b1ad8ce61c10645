"""Files that are whole or not there."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from tempfile import mkstemp


def write_whole(path: str | Path, write: Callable[[Path], object]) -> Path:
    """Write a file beside its place and move it there in one go: what is at `path` is the old file or the new one.

    Parameters
    ----------
    path : str or Path
        Where the file shall be; the folder must exist.
    write : callable
        Writes a file to the path that it is given, with the same suffix.
    """
    path = Path(path)
    descriptor, name = mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
    os.close(descriptor)
    temporary = Path(name)
    try:
        write(temporary)
        # mkstemp lets nobody else read; a file written directly would have what the umask leaves.
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(0o666 & ~mask)
        os.replace(temporary, path)
    except BaseException:  # Ctrl-C too
        temporary.unlink(missing_ok=True)
        raise
    return path
