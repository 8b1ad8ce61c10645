"""Rows of two campaigns in one table, those of the same draws paired."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rumo.campaigns.judging.columns import SETTING, texts
from rumo.campaigns.judging.criteria import Criterion
from rumo.campaigns.judging.results import Results
from rumo.errors import ArgumentError
from rumo.studies.looks import label


@dataclass(frozen=True)
class Together:
    """Two campaigns as one.

    Attributes
    ----------
    results : Results
        All rows, with the campaign and the controller in place of the controller; what has the same draw is paired.
    pairs : tuple of (str, str)
        Which of these belong together.
    drivers : tuple of str
        The controllers of each pair, for readers.
    alone : tuple of str
        Settings that only one of the campaigns has: nothing can be paired by them.
    """

    results: Results
    pairs: tuple[tuple[str, str], ...]
    drivers: tuple[str, ...]
    alone: tuple[str, ...]


def together(first: Results, second: Results, names: tuple[str, str]) -> Together:
    """Put two campaigns together, by settings and seeds.

    A run of one has that of the other as its pair that has the same values of all settings that vary in either, and the
    same controller; two campaigns with a controller each are compared even if these are not the same.

    Raises
    ------
    ArgumentError
        If no controllers can be compared.
    """
    import pandas as pd

    couples = _couples(first, second)
    if not couples:
        got = f"{', '.join(first.controllers)} and {', '.join(second.controllers)}"
        raise ArgumentError("controllers", got, "a controller that drives in both campaigns, or one alone in each")
    single = len(couples) == 1
    criteria = _criteria(first, second)
    mine, theirs = _settings(first), _settings(second)
    alone = tuple(sorted(mine ^ theirs))
    parts: list[Any] = []
    pairs: list[tuple[str, str]] = []
    drivers: list[str] = []
    draws = 0
    for one, other in couples:
        called = [
            name if single and one == other else f"{name} {label(who)}"
            for name, who in zip(names, (one, other), strict=True)
        ]
        rows = [_rows(first, one), _rows(second, other)]
        numbers = _numbers(rows, sorted(mine) if not alone else None, draws)
        for part, name, number in zip(rows, called, numbers, strict=True):
            parts.append(part.assign(controller=name, draw=number))
        pairs.append((called[0], called[1]))
        drivers.append(label(one) if one == other else f"{label(one)}, {label(other)}")
        draws = 1 + max((int(number.max(initial=-1)) for number in numbers), default=draws)
    found = pd.concat(parts, ignore_index=True)
    order = tuple(name for pair in pairs for name in pair)
    results = replace(first, rows=found, criteria=criteria, controllers=order, heat_map=None, folder=None, asked=None)
    return Together(results, tuple(pairs), tuple(drivers), alone)


def _couples(first: Results, second: Results) -> list[tuple[str, str]]:
    common = [name for name in first.controllers if name in second.controllers]
    if not common and len(first.controllers) == len(second.controllers) == 1:
        return [(first.controllers[0], second.controllers[0])]
    return [(name, name) for name in common]


def _settings(results: Results) -> set[str]:
    return {column.removeprefix(SETTING) for column in results.rows.columns if column.startswith(SETTING)}


def _rows(results: Results, controller: str) -> Any:
    return results.rows[results.of(controller)].reset_index(drop=True)


def _numbers(rows: list[Any], settings: list[str] | None, begin: int) -> list[Any]:
    """Numbers of draws of each table, the same for pairs; from `begin` on. Without settings none are paired."""
    if settings is None:
        return [begin + np.arange(len(rows[0])), begin + len(rows[0]) + np.arange(len(rows[1]))]
    known: dict[Any, int] = {}
    return [
        np.array([begin + known.setdefault(key, len(known)) for key in _keys(part, settings)], int) for part in rows
    ]


def _keys(rows: Any, settings: list[str]) -> list[Any]:
    """What says which draw a row is of: its settings, and how often these have been there before."""
    columns = [texts(rows, SETTING + name) for name in settings] if settings else [texts(rows, "draw")]
    seen = Counter[tuple[str, ...]]()
    found: list[Any] = []
    for values in zip(*columns, strict=True):
        found.append((*values, seen[values]))
        seen[values] += 1
    return found


def _criteria(first: Results, second: Results) -> tuple[Criterion, ...]:
    """Those of both; of two that have the same name and ask for different things, each."""
    known = {criterion.name: criterion for criterion in first.criteria}
    for criterion in second.criteria:
        if known.setdefault(criterion.name, criterion) != criterion:
            name = f"{criterion.name}, second"
            known[name] = replace(criterion, name=name)
    return tuple(known.values())


def differing(first: Mapping[str, Any], second: Mapping[str, Any]) -> dict[str, tuple[Any, Any]]:
    """Entries of flat plain data that are not the same; None where one has none."""
    names = dict.fromkeys((*first, *second))
    return {name: (first.get(name), second.get(name)) for name in names if first.get(name) != second.get(name)}
