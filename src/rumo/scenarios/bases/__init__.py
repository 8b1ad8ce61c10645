"""Runs to begin with, by name: each a function of plain keyword arguments that returns a run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from rumo.scenarios.bases.paper import paper
from rumo.scenarios.bases.reactor import reactor
from rumo.scenarios.bases.track import track
from rumo.studies.base import Run

__all__ = ["BASES", "paper", "reactor", "track"]

BASES: Mapping[str, Callable[..., Run]] = MappingProxyType({"paper": paper, "track": track, "reactor": reactor})
"""Functions that make runs, by name."""
