"""One process at a time that writes to a campaign's folder."""

from __future__ import annotations

import os
import platform
from collections.abc import Generator
from contextlib import contextmanager, suppress
from pathlib import Path

from rumo.errors import ArgumentError
from rumo.locks import locked

LOCK = ".lock"
PATIENCE = 1.0
"""How long to wait for another process that is about to leave the folder [s]."""


@contextmanager
def alone(folder: Path) -> Generator[None]:
    """Keep other processes from writing to a folder; its lock says who does."""
    place = folder / LOCK
    with locked(place, PATIENCE) as mine:
        if not mine:
            holder = ""
            with suppress(OSError):  # it has just gone
                holder = place.read_text(encoding="utf-8").strip()
            raise ArgumentError(
                "output",
                f"'{folder}', in use by {holder or 'another process'}",
                "a folder that no other campaign writes to",
                "Wait for it, or name another folder.",
            )
        place.write_text(f"process {os.getpid()} on {platform.node()}\n", encoding="utf-8")
        yield
