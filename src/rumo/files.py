"""Files that are written whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path


def write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Write a file beside its place, under the same name, and move it there in one go.

    Whoever reads `path` finds what was there before or all that is new, and if writing fails or is interrupted nothing
    has changed.

    Parameters
    ----------
    path : Path
        The file; its folder must exist.
    write : callable
        Called with the path to write to.
    """
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=".writing-", ignore_cleanup_errors=True) as beside:
        made = Path(beside, path.name)
        write(made)
        os.replace(made, path)
