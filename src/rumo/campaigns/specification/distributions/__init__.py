"""Distributions of settings: by name, and from plain data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from types import MappingProxyType
from typing import Any

from rumo.campaigns.specification.distributions.base import DISTRIBUTION, Distribution
from rumo.campaigns.specification.distributions.flat import Choice, Integers, LogUniform, Uniform
from rumo.campaigns.specification.distributions.peaked import LogNormal, Normal, Triangular
from rumo.errors import ArgumentError, UnknownNameError

__all__ = [
    "DISTRIBUTION",
    "DISTRIBUTIONS",
    "Choice",
    "Distribution",
    "Integers",
    "LogNormal",
    "LogUniform",
    "Normal",
    "Triangular",
    "Uniform",
    "distribution_of",
]

DISTRIBUTIONS: Mapping[str, type[Distribution]] = MappingProxyType(
    {kind.name: kind for kind in (Uniform, LogUniform, Normal, LogNormal, Triangular, Integers, Choice)}
)
"""By name."""


def distribution_of(table: Mapping[str, Any]) -> Distribution:
    """A distribution from plain data: `{"distribution": "uniform", "low": 0.7, "high": 1.1}`.

    Raises
    ------
    ArgumentError
        If name or parameter is unknown, one is missing, or a value cannot be.
    """
    name = table.get(DISTRIBUTION)
    if not isinstance(name, str) or name not in DISTRIBUTIONS:
        raise UnknownNameError(DISTRIBUTION, name, DISTRIBUTIONS)
    kind, given = DISTRIBUTIONS[name], {key: value for key, value in table.items() if key != DISTRIBUTION}
    known = {item.name: item for item in fields(kind)}  # pyright: ignore[reportArgumentType]
    for key in given:
        if key not in known:
            raise UnknownNameError(key, key, known)
    for key, item in known.items():
        if key not in given and item.default is MISSING and item.default_factory is MISSING:
            raise ArgumentError(key, "nothing", f"a number: {name} needs it")
    return kind(**given)
