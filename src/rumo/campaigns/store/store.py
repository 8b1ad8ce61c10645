"""A campaign's folder: what it is, its rows, and logs of some runs. Nothing that is in it is ever half written."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Set
from contextlib import AbstractContextManager, ExitStack, suppress
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from rumo.campaigns.store.alone import alone
from rumo.campaigns.store.compaction import is_compact, write_compact
from rumo.campaigns.store.parts import (
    ENDING,
    keys_and_outcomes,
    parts_in,
    read_parts,
    read_records,
    remove_temporaries,
    write_part,
)
from rumo.campaigns.store.room import writing_to
from rumo.campaigns.tasks.rows import DONE
from rumo.campaigns.tasks.task import Row, canonical
from rumo.errors import ArgumentError, FileError
from rumo.files import write_whole
from rumo.version import __version__

if TYPE_CHECKING:
    import pandas as pd

FORMAT = 1
"""Of keys and rows: others do not go together."""
HEAD, ROWS, LOGS = "campaign.json", "rows", "logs"
PART = 100
"""Rows from which a part is written."""
PAUSE = 20.0
"""How long a row waits for others until one is [s], after at most ten seconds on a worker."""
MOST_LOGS = 100
"""Logs that are kept as runs end; those of further ones can be made again."""


class Store:
    """Where a campaign's rows are kept, in a folder of which this process has the only store that writes.

    Parameters
    ----------
    folder : Path
        Made if it is not there.
    specification : mapping
        What the campaign is, plain data.
    identity : mapping, optional
        What of it may not change: a folder is of one campaign. All of it if not given.

    Raises
    ------
    ArgumentError
        If the folder is of another campaign, version or format, or in use.
    FileError
        If it has files that no campaign writes.
    """

    def __init__(
        self, folder: str | Path, specification: Mapping[str, Any], identity: Mapping[str, Any] | None = None
    ) -> None:
        self.folder = Path(folder)
        self._buffer: list[Row] = []
        self._stored = 0
        self._since = monotonic()
        head = _head(specification, specification if identity is None else identity)
        with ExitStack() as stack:
            try:
                self._rows.mkdir(parents=True, exist_ok=True)
                stack.enter_context(alone(self.folder))
            except OSError as error:
                raise ArgumentError(
                    "output", f"'{folder}' ({error.strerror})", "a folder that can be written", "Name another folder."
                ) from None
            if (self.folder / HEAD).exists():
                _compare(read_head(self.folder), head, self.folder)
            elif parts_in(self._rows):
                raise FileError(
                    self.folder / HEAD,
                    None,
                    "no such file beside rows",
                    "one that says what they are",
                    "Name another folder.",
                )
            self._head = head
            if not (self.folder / HEAD).exists():
                self.describe()
            remove_temporaries(self._rows)
            parts = parts_in(self._rows)
            self._logs = len([*(self.folder / LOGS).glob("*.nc")])
            self._next = 1 + max((_number(path) for path in parts), default=0)
            self._stack = stack.pop_all()

    def __enter__(self) -> Store:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def _rows(self) -> Path:
        return self.folder / ROWS

    def describe(self) -> None:
        """Have the folder say what the campaign is now, in what may change from one start to the next."""
        text = json.dumps(self._head, indent=2) + "\n"

        with self._guarded():
            write_whole(self.folder / HEAD, lambda place: place.write_text(text, encoding="utf-8"), durable=True)

    def keys(self, *, failed: bool = True) -> set[str]:
        """Of the rows that are stored; on demand only of those whose runs came to their end."""
        table = read_parts(parts_in(self._rows), ["key", "outcome"])
        return {key for key, outcome in keys_and_outcomes(table) if failed or outcome == DONE}

    def rows(self) -> pd.DataFrame:
        """All rows that are stored."""
        return read_rows(self.folder)

    def records(self, keys: Set[str]) -> list[Row]:
        """Those of the rows that are stored which have one of some keys."""
        return read_records(parts_in(self._rows), keys)

    @property
    def takes_logs(self) -> bool:
        """Whether `add` would keep the log of a further run."""
        return self._logs < MOST_LOGS

    def add(self, row: Row) -> None:
        """Keep a row, in a file after a while; its `log` in one of its own at once, if there are few of these.

        Raises
        ------
        CampaignError
            If files cannot be written. Rows that are not stored yet are kept, see `flush`.
        """
        log = row.get("log")
        if not self._buffer:
            self._since = monotonic()
        self._buffer.append({name: value for name, value in row.items() if name != "log"})
        if log is not None and self.takes_logs:
            self.keep_log(row["key"], log)
            self._logs += 1
        if len(self._buffer) >= PART:
            self.flush()
        self.flush_in_time()

    def flush_in_time(self) -> None:
        """Store all rows if one has waited for long: to be called now and then while no row comes.

        Raises
        ------
        CampaignError
            See `flush`.
        """
        if self._buffer and monotonic() - self._since >= PAUSE:
            self.flush()

    def flush(self) -> None:
        """Store all rows now.

        Raises
        ------
        CampaignError
            If that is not possible; the rows are kept for another attempt.
        """
        if not self._buffer:
            return
        with self._guarded():
            write_part(self._rows / _name(self._next), self._buffer)
        self._stored += len(self._buffer)
        self._buffer, self._next = [], self._next + 1

    def compact(self) -> None:
        """Put all rows into one part, by draw and controller. Whenever this is broken off, all rows are there.

        Raises
        ------
        CampaignError
            If files cannot be written.
        """
        self.flush()
        parts = parts_in(self._rows)
        if not parts or is_compact(parts):
            return
        with self._guarded():
            write_compact(self._rows / _name(self._next), parts)
        self._next += 1
        for path in parts:
            with suppress(OSError):  # somebody reads it: the next time, and until then its rows are there twice
                path.unlink()

    def close(self) -> None:
        """Let others use the folder; what was not flushed is forgotten."""
        self._stack.close()

    def keep_log(self, key: str, log: bytes) -> None:
        """Keep the log of a run, a NetCDF file.

        Raises
        ------
        CampaignError
            If it cannot be written.
        """
        folder = self.folder / LOGS

        with self._guarded():
            folder.mkdir(exist_ok=True)
            write_whole(folder / f"{key}.nc", lambda place: place.write_bytes(log))

    def _guarded(self) -> AbstractContextManager[None]:
        return writing_to(self.folder, self._stored_until_now)

    def _stored_until_now(self) -> str:
        waiting = len(self._buffer)
        unstored = f", {waiting} {'row' if waiting == 1 else 'rows'} not yet" if waiting else ""
        are = "row of this start is" if self._stored == 1 else "rows of this start are"
        return f"{self._stored} {are} stored{unstored}."


def read_head(folder: str | Path) -> dict[str, Any]:
    """What `campaign.json` says: `format`, `rumo`, `specification`, `identity` and its `hash`.

    Raises
    ------
    ArgumentError
        If the folder has no campaign, or one of another format.
    FileError
        If the file is none of ours.
    """
    path = Path(folder) / HEAD
    try:
        head = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ArgumentError("campaign", f"'{folder}'", f"the folder of a campaign, with {HEAD}") from None
    except (OSError, ValueError) as error:
        raise FileError(
            path, None, f"what cannot be read ({error})", "a campaign's head", "Name another folder."
        ) from None
    if not isinstance(head, dict) or not {"format", "rumo", "hash", "specification"} <= head.keys():
        raise FileError(path, None, "something else", "a campaign's head", "Name another folder.")
    if head["format"] != FORMAT:
        raise ArgumentError(
            "campaign", f"'{folder}' of format {head['format']}", f"format {FORMAT}", f"Rumo {head['rumo']} wrote it."
        )
    return head


def read_rows(folder: str | Path) -> pd.DataFrame:
    """All rows of a campaign, also while it is under way.

    Returns
    -------
    pandas.DataFrame
        A row for each run, each once; see `Engine.rows`.

    Raises
    ------
    ArgumentError
        If the folder has no campaign.
    FileError
        If it has files that no campaign writes, or torn ones.
    """
    read_head(folder)
    with suppress(FileNotFoundError):  # parts have just been put into one
        return read_parts(parts_in(Path(folder) / ROWS)).to_pandas()
    return read_parts(parts_in(Path(folder) / ROWS)).to_pandas()


def _head(specification: Mapping[str, Any], identity: Mapping[str, Any]) -> dict[str, Any]:
    digest = hashlib.sha256(canonical(identity).encode()).hexdigest()
    # As JSON has them, in their order: the first criterion is the first that was given.
    told = {"specification": json.loads(json.dumps(specification)), "identity": json.loads(json.dumps(identity))}
    return {"format": FORMAT, "rumo": __version__, "hash": digest, **told}


def _compare(found: Mapping[str, Any], wanted: Mapping[str, Any], folder: Path) -> None:
    cure = "Name another folder, or remove this one."
    if found["rumo"] != wanted["rumo"]:
        raise ArgumentError("output", f"'{folder}' of Rumo {found['rumo']}", f"rows of Rumo {wanted['rumo']}", cure)
    if found["hash"] != wanted["hash"]:
        from rumo.scenarios.differences import differences  # which takes 70 MB along

        words = differences(found.get("identity", {}), wanted["identity"])
        got = f"'{folder}' of another campaign{f': {words}' if words else ''}"
        raise ArgumentError("output", got, "a folder of this campaign", cure)


def _name(number: int) -> str:
    return f"{number:06d}{ENDING}"


def _number(path: Path) -> int:
    return int(path.stem) if path.stem.isdecimal() else 0
