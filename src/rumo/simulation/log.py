"""Logs as files, and what to read in them."""

from __future__ import annotations

import hashlib
import logging
import os
import stat
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from rumo.checks import printable
from rumo.errors import ArgumentError
from rumo.files import write_whole
from rumo.signals import Array
from rumo.simulation.variables import OBSERVED, TEXTS, TIMES, VARIABLES

if TYPE_CHECKING:
    import xarray as xr

logger = logging.getLogger("rumo")

SEAL = b"\nrumo log, SHA-256 of all before this line: "
"""What stands after the data, before the digest and a line's end; HDF5 does not look there."""
SEALED = len(SEAL) + 64 + 1
DENSEST = 1000
"""How many times its size a file may hold, compressed."""


def save(log: xr.Dataset, path: str | Path) -> Path:
    """Write a log as NetCDF, with a checksum, whole or not at all; the folder must exist.

    Raises
    ------
    ArgumentError
        If it lacks what a log has, or a text of it cannot be kept in a file.
    """
    lack = _lack(log)
    if lack:
        cure = "Other datasets are written by their method to_netcdf."
        raise ArgumentError("log", f"a dataset with {lack}", "a log of simulate or a Recorder", cure)
    for owner, attributes in (("log", log.attrs), *((f"log[{str(k)!r}]", v.attrs) for k, v in log.variables.items())):
        for name, value in attributes.items():
            printable(name, f"{owner}.attrs")
            if isinstance(value, str):
                printable(value, f"{owner}.attrs[{name!r}]")
    for name, variable in log.variables.items():
        printable(name, "log.variables")
        if variable.dtype.kind in "UO":
            for text in variable.to_numpy().ravel().tolist():
                printable(text, f"log[{name!r}]")
    if "\0" in str(path):
        raise ArgumentError("path", repr(str(path)), "a name that a file can have")
    return write_whole(path, partial(_write, log))


def load(path: str | Path) -> xr.Dataset:
    """Read a log written by `save`.

    A file without a checksum, which another program may have written, is read with a warning of the logger `rumo`.

    Raises
    ------
    ArgumentError
        If the file was changed since it was written, is no log, or claims to hold more than fits into it.
    OSError
        If it cannot be read at all.
    """
    import xarray as xr  # heavy; a controller alone does without it

    if "\0" in str(path):
        raise _unfit(path, "which no file can be called")
    with open(path, "rb") as file:
        status = os.fstat(file.fileno())
        if not stat.S_ISREG(status.st_mode):
            raise _unfit(path, "which is no file")
        sealed = _is_sealed(file, status.st_size, path)
    try:
        claimed = _claimed(path)
        if claimed > DENSEST * status.st_size:
            raise _unfit(path, f"{status.st_size} bytes that claim to hold {claimed}")
        log = xr.load_dataset(path, engine="h5netcdf")
    except ArgumentError:
        raise
    except Exception as error:  # h5py, h5netcdf and xarray raise whatever damaged bytes lead them to
        raise _unfit(path, f"which cannot be read ({type(error).__name__}: {error})") from error
    lack = _lack(log)
    if lack:
        raise _unfit(path, f"with {lack}")
    if not sealed:
        logger.warning(
            "%s has no checksum: whether it is as it was written cannot be told. Saved again, it has one.", path
        )
    return log


def _write(log: xr.Dataset, place: Path) -> None:
    log.to_netcdf(place, engine="h5netcdf")
    with place.open("r+b") as file:
        digest = _digest(file, os.fstat(file.fileno()).st_size)
        file.seek(0, os.SEEK_END)
        file.write(SEAL + digest + b"\n")


def _is_sealed(file: BinaryIO, size: int, path: str | Path) -> bool:
    """Whether a file has a checksum; one that is not that of its content raises."""
    file.seek(max(size - SEALED, 0))
    end = file.read(SEALED)
    if not end.startswith(SEAL):
        return False
    if end != SEAL + _digest(file, size - SEALED) + b"\n":
        raise _unfit(path, "whose content is not what its checksum was made of")
    return True


def _digest(file: BinaryIO, size: int) -> bytes:
    """Digest of the first bytes of a file, in hexadecimal."""
    digest = hashlib.sha256()
    file.seek(0)
    while size > 0:
        block = file.read(min(size, 2**20))
        if not block:
            break
        digest.update(block)
        size -= len(block)
    return digest.hexdigest().encode()


def _claimed(path: str | Path) -> int:
    """How many bytes a file says that its arrays take."""
    import h5py  # as heavy

    sizes: list[int] = []
    with h5py.File(path, "r") as file:
        file.visititems(lambda _, item: sizes.append(item.nbytes) if isinstance(item, h5py.Dataset) else None)
    return sum(sizes)


def _lack(log: xr.Dataset) -> str:
    """What a dataset lacks of a log; nothing if it is one."""
    variables = VARIABLES | OBSERVED if "observed_state" in log.dims else VARIABLES
    for name, dims in (
        ("time", ()),
        *((name, dims) for name, (dims, _) in variables.items()),
        *((t, ()) for t in TIMES),
    ):
        if name not in log.variables:
            return f"no variable {name!r}"
        variable, wanted = log.variables[name], ("time", *dims)
        if variable.dims != wanted:
            return f"the variable {name!r} over {variable.dims}, not {wanted}"
        kinds, kind = ("UO", "text") if name in TEXTS else ("f", "floats")
        if variable.dtype.kind not in kinds:
            return f"the variable {name!r} of type {variable.dtype}, not {kind}"
    return ""


def _unfit(path: str | Path, what: str) -> ArgumentError:
    cure = "Take a copy, or run the scenario again."
    return ArgumentError("path", f"{str(path)!r}, {what}", "a log as `save` writes it", cure)


def signal(log: xr.Dataset, variable: str, name: str) -> Array:
    """One signal of a log as an array (K,): `signal(log, "plant", "v_x")`."""
    values = log.variables[variable]
    known = log.variables[values.dims[-1]].to_numpy().tolist()
    if name not in known:
        raise KeyError(name)
    return values.to_numpy()[..., known.index(name)]


def names(log: xr.Dataset, dim: str) -> Sequence[str]:
    """Signal names along a dimension of a log."""
    return [str(name) for name in log.variables[dim].to_numpy().tolist()]
