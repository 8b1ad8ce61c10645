"""Columns as Arrow keeps them, from Python's values.

They are put together from Arrow's buffers, since `pyarrow.array` imports pandas wherever it is installed, which takes
more memory than Dask does: reports need it, but the process that carries out a campaign does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rumo.campaigns.store.kinds import Kind
from rumo.extras import required

_FACTORIES = {"null": "null", "bool": "bool_", "int64": "int64", "double": "float64", "string": "string"}
_NUMBERS = {"int64": np.int64, "double": np.float64}


def array_of(values: Sequence[Any], kind: Kind) -> Any:
    """An Arrow array of values, each of the kind or None."""
    arrow = required("pyarrow", "campaign", "campaign")
    if kind == "null":
        return arrow.nulls(len(values))
    known = [value is not None for value in values]
    buffers: list[Any] = [None if all(known) else _bits(known)]
    if kind == "string":
        texts = [b"" if value is None else value.encode("utf-8", "backslashreplace") for value in values]
        ends = np.cumsum([0, *map(len, texts)], dtype=np.int32)
        buffers += [arrow.py_buffer(ends), arrow.py_buffer(b"".join(texts))]
    elif kind == "bool":
        buffers.append(_bits([bool(value) for value in values]))
    else:
        filled = [0 if value is None else value for value in values]
        buffers.append(arrow.py_buffer(np.array(filled, dtype=_NUMBERS[kind])))
    return arrow.Array.from_buffers(type_of(kind), len(values), buffers)


def type_of(kind: Kind) -> Any:
    """Arrow's type of a kind."""
    return getattr(required("pyarrow", "campaign", "campaign"), _FACTORIES[kind])()


def _bits(values: Sequence[bool]) -> Any:
    arrow = required("pyarrow", "campaign", "campaign")
    return arrow.py_buffer(np.packbits(np.array(values, dtype=bool), bitorder="little"))
