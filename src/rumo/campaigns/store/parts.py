"""Parts of a dataset: Parquet files with rows, each written whole or not at all."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence, Set
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rumo.campaigns.store.arrays import array_of, type_of
from rumo.campaigns.store.kinds import Kind, common_kind, converted, in_order, kind_of
from rumo.campaigns.tasks.rows import DONE
from rumo.campaigns.tasks.task import Row
from rumo.errors import FileError
from rumo.extras import required
from rumo.files import write_whole

ENDING = ".parquet"
CHUNK = 10_000
"""Rows of which keys are texts of Python's at a time."""
CURE = "Move it away: runs of which it had the rows are made again."


def parts_in(folder: Path) -> list[Path]:
    """The parts in a folder, oldest first.

    Raises
    ------
    FileError
        If there is something else.
    """
    found = sorted(path for path in folder.iterdir() if not path.name.startswith("."))
    for path in found:
        if path.suffix != ENDING or not path.is_file():
            raise FileError(
                path, None, "something that no campaign writes", f"only files *{ENDING} in this folder", CURE
            )
    return found


def remove_temporaries(folder: Path) -> None:
    """Remove what a writer has left that was killed."""
    for path in folder.glob(f".*{ENDING}"):
        path.unlink(missing_ok=True)


def write_part(path: Path, rows: Sequence[Row]) -> None:
    """Write rows, with the columns that they have.

    Raises
    ------
    OSError
        If they cannot be written; then there is no such file.
    """
    write_whole(path, lambda place: _parquet().write_table(_table_of(rows), place), durable=True)


def read_parts(paths: Iterable[Path], columns: Sequence[str] | None = None) -> Any:
    """All rows of parts, as an Arrow table: each key once, a run that came to its end before others, else the last.

    Parameters
    ----------
    paths : iterable of Path
        The parts, oldest first.
    columns : sequence of str, optional
        Those that are wanted; all by default.

    Raises
    ------
    FileError
        If one is torn, or has no rows of a campaign.
    """
    tables = [_read(path, columns) for path in paths]
    kinds = kinds_of(table.schema for table in tables) or dict.fromkeys(columns or ("key", "outcome"), "null")
    table = put_together(tables, kinds)
    return table.take(array_of(chosen(table), "int64"))


def read_records(paths: Iterable[Path], keys: Set[str]) -> list[Row]:
    """Rows of some keys, with the columns of their part; the same ones as `read_parts` has."""
    found: dict[str, Row] = {}
    for path in paths:
        with opened(path) as file:
            for group in range(file.num_row_groups):
                there = file.read_row_group(group, ["key"])["key"].to_pylist()
                wanted = [i for i, key in enumerate(there) if key in keys]
                if not wanted:
                    continue
                for row in file.read_row_group(group).take(array_of(wanted, "int64")).to_pylist():
                    before = found.get(row["key"])
                    if before is None or before["outcome"] != DONE:
                        found[row["key"]] = row
    return [*found.values()]


def kinds_of(schemas: Iterable[Any]) -> dict[str, Kind]:
    """Columns of tables with these Arrow schemas, in order, each with the kind that holds its values in all of them."""
    found: dict[str, set[Kind]] = {}
    for schema in schemas:
        for field in schema:
            found.setdefault(field.name, set()).add(str(field.type))
    return {name: common_kind(found[name]) for name in in_order(found)}


def put_together(tables: Sequence[Any], kinds: Mapping[str, Kind]) -> Any:
    """All rows of Arrow tables, in one with columns of these kinds."""
    arrow = _arrow()
    schema = schema_of(kinds)
    empty = arrow.table([arrow.nulls(0, field.type) for field in schema], schema=schema)
    return arrow.concat_tables([_cast(table, schema, kinds) for table in tables] or [empty])


def schema_of(kinds: Mapping[str, Kind]) -> Any:
    """Arrow's schema of columns of these kinds."""
    return _arrow().schema([(name, type_of(kind)) for name, kind in kinds.items()])


def chosen(table: Any) -> list[int]:
    """Which rows count, of each key one: that of a run that came to its end, else the last."""
    best, done = dict[str, int](), bytearray()
    for i, (key, outcome) in enumerate(keys_and_outcomes(table)):
        done.append(outcome == DONE)
        before = best.get(key)
        if before is None or not done[before]:
            best[key] = i
    return sorted(best.values())


def keys_and_outcomes(table: Any) -> Iterator[tuple[str, str]]:
    """Of each row, read as they are asked for."""
    for batch in table.select(["key", "outcome"]).to_batches(CHUNK):
        yield from zip(batch["key"].to_pylist(), batch["outcome"].to_pylist(), strict=True)


def _table_of(rows: Sequence[Row]) -> Any:
    arrays: dict[str, Any] = {}
    for name in in_order(name for row in rows for name in row):
        values = [row.get(name) for row in rows]
        kind = common_kind(kind_of(value, name) for value in values)
        arrays[name] = array_of([converted(value, kind) for value in values], kind)
    return _arrow().table(arrays)


def _read(path: Path, columns: Sequence[str] | None) -> Any:
    with opened(path) as file:
        there = file.schema_arrow.names
        return file.read([name for name in columns if name in there] if columns is not None else None)


@contextmanager
def opened(path: Path) -> Generator[Any]:
    """A part as a file of Parquet's.

    Raises
    ------
    FileNotFoundError
        If it has gone.
    FileError
        If it is torn, or has no rows of a campaign.
    """
    try:
        with _parquet().ParquetFile(path) as file:
            there = file.schema_arrow.names
            missing = [name for name in ("key", "outcome") if name not in there]
            if missing:
                raise FileError(path, None, f"no column {missing[0]!r}", "rows of a campaign", CURE)
            yield file
    except FileNotFoundError:
        raise
    except (_arrow().ArrowException, OSError) as error:
        raise FileError(path, None, f"a file that is torn ({error})", "a whole Parquet file", CURE) from None


def _kind(table: Any, name: str) -> Kind:
    return str(table.schema.field(name).type) if name in table.column_names else "null"


def _cast(table: Any, schema: Any, kinds: Mapping[str, Kind]) -> Any:
    arrow = _arrow()
    arrays: list[Any] = []
    for field in schema:
        before, kind = _kind(table, field.name), kinds[field.name]
        if before == "null":
            arrays.append(arrow.nulls(len(table), field.type))
        elif before == kind:
            arrays.append(table[field.name])
        else:
            chunks = ([converted(value, kind) for value in chunk.to_pylist()] for chunk in table[field.name].chunks)
            arrays.append(arrow.chunked_array([array_of(chunk, kind) for chunk in chunks], field.type))
    return arrow.table(arrays, schema=schema)


def _arrow() -> Any:
    return required("pyarrow", "campaign", "campaign")


def _parquet() -> Any:
    return required("pyarrow.parquet", "campaign", "campaign")
