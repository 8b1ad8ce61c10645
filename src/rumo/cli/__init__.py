"""The command `rumo`."""

from rumo.cli.entry import main

__all__ = ["main"]
