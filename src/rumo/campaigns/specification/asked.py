"""What is asked of drives: figures of merit and criteria, by names that there are."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rumo.campaigns.judging.criteria import Criterion
from rumo.campaigns.work import COUNTS, STEP_TIMES, TIMES
from rumo.checks import as_mapping
from rumo.errors import ArgumentError, UnknownNameError
from rumo.studies.kpis import KPIS

OTHER_KEYS = {f"step_time_{part}_us": "step_time" for part in STEP_TIMES} | {"deadline_misses": "deadline_misses"}
"""Figures that rows have by keys of their own: those of times."""

EVERY = "figures of merit (all of them: rumo.studies.kpis.KPIS, and the documentation's page on logs)"


def kpi_name(key: object, argument: str) -> str:
    """Name of a figure of merit, from its name or its key, which may have a part; others raise, naming `argument`."""
    known = {kpi.key: name for name, kpi in KPIS.items()} | {name: name for name in KPIS} | OTHER_KEYS
    if not isinstance(key, str) or key.partition(".")[0] not in known:
        keys = [kpi.key for kpi in KPIS.values()]
        raise UnknownNameError(argument, key, KPIS if argument == "kpis" else (*keys, *OTHER_KEYS), among=EVERY)
    return known[key.partition(".")[0]]


def kpi_key(key: object, argument: str) -> str:
    """Key by which rows have a figure of merit, from its name or key, which may have a part."""
    name = kpi_name(key, argument)
    head, _, part = str(key).partition(".")
    if name == COUNTS:
        raise ArgumentError(
            argument, repr(key), "a figure of merit with a limit", "Fallbacks are counted by fallbacks."
        )
    if name in TIMES and head not in OTHER_KEYS:
        raise UnknownNameError(argument, key, OTHER_KEYS)
    head = head if head in OTHER_KEYS else KPIS[name].key
    return f"{head}.{part}" if part else head


def as_criterion(name: str, value: Any) -> Criterion:
    """A criterion of a figure that rows have, from one or from plain data."""
    criterion = value if isinstance(value, Criterion) else Criterion.of(name, value)
    key = kpi_key(criterion.kpi, f"criteria.{name}.kpi")
    return Criterion(name, key, criterion.at_most, criterion.at_least)


def as_report(report: Any, vary: Mapping[str, Any]) -> dict[str, Any]:
    """What a report shows besides what all do."""
    shown = as_mapping(report, "report")
    for key in shown:
        if key != "heat_map":
            raise UnknownNameError(f"report.{key}", key, ("heat_map",))
    names = shown.get("heat_map", [])
    if not isinstance(names, list | tuple) or len(names) not in (0, 2):
        raise ArgumentError("report.heat_map", repr(names), "two settings that vary, as a list of their names")
    for name in names:
        if name not in vary:
            raise UnknownNameError("report.heat_map", name, vary)
    if names and names[0] == names[1]:
        raise ArgumentError("report.heat_map", f"{names[0]!r} twice", "two settings that vary")
    return {"heat_map": list(names)} if names else {}
