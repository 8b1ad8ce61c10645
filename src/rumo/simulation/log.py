"""Logs as files, and what to read in them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rumo.files import write_whole
from rumo.signals import Array

if TYPE_CHECKING:
    import xarray as xr


def save(log: xr.Dataset, path: str | Path) -> Path:
    """Write a log as NetCDF, whole or not at all; the folder must exist."""
    return write_whole(path, lambda place: log.to_netcdf(place, engine="h5netcdf"))


def load(path: str | Path) -> xr.Dataset:
    """Read a log written by `save`."""
    import xarray as xr

    return xr.load_dataset(path, engine="h5netcdf")


def signal(log: xr.Dataset, variable: str, name: str) -> Array:
    """One signal of a log as an array (K,): `signal(log, "plant", "v_x")`."""
    dim = log[variable].dims[-1]
    return log[variable].sel({dim: name}).to_numpy()


def names(log: xr.Dataset, dim: str) -> Sequence[str]:
    """Signal names along a dimension of a log."""
    return [str(name) for name in log[dim].to_numpy()]
