"""The command `rumo`."""

from rumo.cli.app import app, main

__all__ = ["app", "main"]
