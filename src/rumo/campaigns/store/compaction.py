"""All rows of a campaign put into one part, in order, without having them all in memory."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Generator, Sequence
from itertools import accumulate
from pathlib import Path
from typing import Any

from rumo.campaigns.store.arrays import array_of
from rumo.campaigns.store.kinds import Kind
from rumo.campaigns.store.parts import chosen, kinds_of, opened, put_together, schema_of
from rumo.extras import required
from rumo.files import write_whole

ORDER = ("draw", "controller", "key")
"""By which rows are sorted."""
MARK = b"rumo.compact"
"""Of a part with all rows in order, in Parquet's metadata."""
GROUP = 5000
"""Rows that are read and written at a time."""

Place = tuple[Path, int]
"""A part, and a group of its rows."""


def is_compact(parts: Sequence[Path]) -> bool:
    """Whether `write_compact` has written all that parts have."""
    if len(parts) != 1:
        return False
    with opened(parts[0]) as file:
        return MARK in (file.schema_arrow.metadata or {})


def write_compact(path: Path, parts: Sequence[Path]) -> None:
    """Write the rows of parts, oldest first, each run once, by draw, controller and key.

    Raises
    ------
    OSError
        If they cannot be written; then there is no such file.
    FileError
        If a part is torn, or has no rows of a campaign.
    """
    places, starts = list[Place](), [0]

    def schemas() -> Generator[Any]:
        for part in parts:
            with opened(part) as file:
                for i in range(file.num_row_groups):
                    places.append((part, i))
                    starts.append(starts[-1] + file.metadata.row_group(i).num_rows)
                yield file.schema_arrow

    kinds = kinds_of(schemas())
    rows = _in_order(parts, kinds)
    parquet: Any = required("pyarrow.parquet", "campaign", "campaign")

    def write(place: Path) -> None:
        with parquet.ParquetWriter(place, schema_of(kinds).with_metadata({MARK: b"1"})) as writer:
            for group in _groups(places, starts, rows, kinds):
                writer.write_table(group)

    write_whole(path, write, durable=True)


def _in_order(parts: Sequence[Path], kinds: dict[str, Kind]) -> Any:
    """Numbers of the rows that count, in the order of the part with all of them, counted over parts."""
    decisive = [name for name in kinds if name in (*ORDER, "outcome")]
    tables = list[Any]()
    for part in parts:
        with opened(part) as file:
            tables.append(file.read([name for name in decisive if name in file.schema_arrow.names]))
    table = put_together(tables, {name: kinds[name] for name in decisive})
    table = table.append_column("number", array_of(range(len(table)), "int64")).take(array_of(chosen(table), "int64"))
    order = [(name, "ascending") for name in ORDER if name in decisive]
    return table.sort_by(order)["number"]


def _groups(places: Sequence[Place], starts: Sequence[int], rows: Any, kinds: dict[str, Kind]) -> Generator[Any]:
    """Tables of rows, by their numbers: groups of parts are in memory as long as there are rows of theirs."""
    there: dict[int, Any] = {}
    for first in range(0, len(rows), GROUP):
        wanted = rows.slice(first, GROUP).to_pylist()
        of_row = [bisect_right(starts, row) - 1 for row in wanted]
        there = {i: there[i] if i in there else _read(places[i]) for i in sorted({*of_row})}
        begins = dict(zip(there, accumulate((len(table) for table in there.values()), initial=0), strict=False))
        table = put_together([*there.values()], kinds)
        yield table.take(
            array_of([begins[i] + row - starts[i] for i, row in zip(of_row, wanted, strict=True)], "int64")
        )


def _read(place: Place) -> Any:
    part, group = place
    with opened(part) as file:
        return file.read_row_group(group)
