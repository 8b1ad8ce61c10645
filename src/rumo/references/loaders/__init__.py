"""Tracks and race lines from files."""

from rumo.references.loaders.load import load_race_line, load_track

__all__ = ["load_race_line", "load_track"]
