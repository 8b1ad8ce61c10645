"""Objects through a pipe, each with its size before it."""

from __future__ import annotations

import pickle
import struct
from typing import IO, Any

_SIZE = struct.Struct("!Q")


def send(stream: IO[bytes], content: object) -> None:
    """Write an object; the reader is of the same version of Python, and trusted."""
    data = pickle.dumps(content, pickle.HIGHEST_PROTOCOL)
    stream.write(_SIZE.pack(len(data)))
    stream.write(data)
    stream.flush()


def receive(stream: IO[bytes]) -> Any:
    """Read an object.

    Raises
    ------
    EOFError
        If the writer has gone, be it in the middle of one.
    """
    (size,) = _SIZE.unpack(_exactly(stream, _SIZE.size))
    return pickle.loads(_exactly(stream, size))


def _exactly(stream: IO[bytes], size: int) -> bytes:
    data = stream.read(size)
    if len(data) < size:
        raise EOFError
    return data
