"""The command `rumo`."""

from rumo.cli.app import app

__all__ = ["app"]
