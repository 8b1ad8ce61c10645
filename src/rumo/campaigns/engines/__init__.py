"""Where a campaign's runs are carried out: in one process beside this one, or by Dask on many."""

from rumo.campaigns.engines.dask import DaskEngine
from rumo.campaigns.engines.serial import SerialEngine

__all__ = ["DaskEngine", "SerialEngine"]
