"""Parts of a dataset: Parquet files with rows, each written whole or not at all."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from rumo.campaigns.store.kinds import Kind, common_kind, converted, in_order, kind_of
from rumo.campaigns.tasks.rows import DONE
from rumo.campaigns.tasks.task import Row
from rumo.errors import FileError
from rumo.extras import required
from rumo.files import write_whole

ENDING = ".parquet"
ORDER = ("draw", "controller", "key")
"""By which rows of one part that has all are sorted."""
COMPACT = b"rumo.compact"
"""A mark of such a part, in Parquet's metadata."""
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
    _write(path, _table_of(rows))


def write_compact(path: Path, parts: Iterable[Path]) -> None:
    """Write the rows of parts, oldest first, by draw and controller, into one that says so.

    Raises
    ------
    OSError
        If they cannot be written; then there is no such file.
    FileError
        See `read_parts`.
    """
    table = read_parts(parts)
    order = [(name, "ascending") for name in ORDER if name in table.column_names]
    _write(path, table.sort_by(order).replace_schema_metadata({COMPACT: b"1"}))


def is_compact(parts: Sequence[Path]) -> bool:
    """Whether `write_compact` has written all rows of some parts."""
    if len(parts) != 1:
        return False
    try:
        return COMPACT in (_parquet().read_schema(parts[0]).metadata or {})
    except (_arrow().ArrowException, OSError):  # for those to say who read its rows
        return False


def read_parts(paths: Iterable[Path], columns: Sequence[str] | None = None) -> Any:
    """All rows of parts, as an Arrow table: each key once, a run that came to its end before others, else the first.

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
    arrow = _arrow()
    tables = [_read(path, columns) for path in paths]
    names = in_order(name for table in tables for name in table.column_names) or list(columns or ("key", "outcome"))
    kinds = {name: common_kind(_kind(table, name) for table in tables) for name in names}
    schema = arrow.schema([(name, getattr(arrow, _FACTORIES[kinds[name]])()) for name in names])
    table = arrow.concat_tables([_cast(table, schema, kinds) for table in tables] or [schema.empty_table()])
    chosen = _chosen(table["key"].to_pylist(), table["outcome"].to_pylist())
    return table.take(arrow.array(chosen, arrow.int64()))


_FACTORIES = {"null": "null", "bool": "bool_", "int64": "int64", "double": "float64", "string": "string"}


def _write(path: Path, table: Any) -> None:
    write_whole(path, lambda place: _parquet().write_table(table, place), durable=True)


def _table_of(rows: Sequence[Row]) -> Any:
    arrow = _arrow()
    arrays: dict[str, Any] = {}
    for name in in_order(name for row in rows for name in row):
        values = [row.get(name) for row in rows]
        kind = common_kind(kind_of(value, name) for value in values)
        kept = [converted(value, kind) for value in values]
        arrays[name] = arrow.array(kept, getattr(arrow, _FACTORIES[kind])())
    return arrow.table(arrays)


def _read(path: Path, columns: Sequence[str] | None) -> Any:
    arrow, parquet = _arrow(), _parquet()
    try:
        with parquet.ParquetFile(path) as file:
            there = file.schema_arrow.names
            missing = [name for name in ("key", "outcome") if name not in there]
            if missing:
                raise FileError(path, None, f"no column {missing[0]!r}", "rows of a campaign", CURE)
            return file.read([name for name in columns if name in there] if columns is not None else None)
    except FileNotFoundError:
        raise
    except (arrow.ArrowException, OSError) as error:
        raise FileError(path, None, f"a file that is torn ({error})", "a whole Parquet file", CURE) from None


def _kind(table: Any, name: str) -> Kind:
    return str(table.schema.field(name).type) if name in table.column_names else "null"


def _cast(table: Any, schema: Any, kinds: dict[str, Kind]) -> Any:
    arrow = _arrow()
    arrays: list[Any] = []
    for field in schema:
        before = _kind(table, field.name)
        if before == "null":
            arrays.append(arrow.nulls(len(table), field.type))
        elif before == kinds[field.name]:
            arrays.append(table[field.name])
        else:
            values = [converted(value, kinds[field.name]) for value in table[field.name].to_pylist()]
            arrays.append(arrow.array(values, field.type))
    return arrow.table(arrays, schema=schema)


def _chosen(keys: list[str], outcomes: list[str]) -> list[int]:
    """Which rows count, of each key one."""
    best: dict[str, int] = {}
    for i, key in enumerate(keys):
        before = best.get(key)
        if before is None or outcomes[before] != DONE:  # of those that failed, the last
            best[key] = i
    return sorted(best.values())


def _arrow() -> Any:
    return required("pyarrow", "campaign", "campaign")


def _parquet() -> Any:
    return required("pyarrow.parquet", "campaign", "campaign")
