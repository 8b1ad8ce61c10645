"""Campaigns from files: their tables, and errors that say where in a file something is wrong."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rumo.campaigns.distributions import DISTRIBUTION, Distribution, distribution_of
from rumo.campaigns.sampling import Grid
from rumo.errors import ArgumentError, FileError, UnknownNameError
from rumo.scenarios import Recipe
from rumo.scenarios.files import line_of

TABLES = ("campaign", "scenario", "vary", "criteria", "report")
SETTINGS = ("runs", "controllers", "sampling", "seed", "timeout", "kpis", "logs")
"""Keys of the table `[campaign]`."""


def campaign_arguments(tables: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Arguments of a `Campaign` from plain data, as a file has it; names of files in it are relative to a folder."""
    for name in tables:
        if name not in TABLES:
            raise UnknownNameError(name, name, TABLES)
    for name in TABLES:
        if not isinstance(tables.get(name, {}), Mapping):
            raise ArgumentError(name, repr(tables[name]), f"a table: [{name}]")
    settings = dict(tables.get("campaign", {}))
    for name in settings:
        if name not in SETTINGS:
            raise UnknownNameError(f"campaign.{name}", name, SETTINGS)
    for name in ("controllers", "kpis"):
        if name in settings:
            if not isinstance(settings[name], list):
                raise ArgumentError(f"campaign.{name}", repr(settings[name]), 'a list such as ["rti", "ltv"]')
            settings[name] = tuple(settings[name])
    with _within("scenario"):
        recipe = Recipe.of(tables.get("scenario"), folder)
    others = {name: tables.get(name, {}) for name in ("criteria", "report")}
    return {"recipe": recipe, "vary": dict(_varied(tables.get("vary", {}), "")), **others, **settings}


def _varied(table: Mapping[str, Any], prefix: str) -> Generator[tuple[str, Grid | Distribution]]:
    for key, value in table.items():
        name = f"{prefix}{key}"
        with _within(f"vary.{name}"):
            if isinstance(value, list):
                yield name, Grid(value)
            elif not isinstance(value, Mapping):
                expected = "a list, { from = ..., to = ... }, or { distribution = ..., ... }"
                raise ArgumentError("", repr(value), expected, "What does not vary belongs to [scenario].")
            elif DISTRIBUTION in value:
                yield name, distribution_of(value)
            elif "from" in value or "to" in value:
                yield name, Grid.of(value)
        if isinstance(value, Mapping) and not {DISTRIBUTION, "from", "to"} & value.keys():
            yield from _varied(value, f"{name}.")


@contextmanager
def _within(table: str) -> Generator[None]:
    """Errors name the table in which their argument is."""
    try:
        yield
    except ArgumentError as error:
        raise renamed(error, f"{table}.{error.argument}".rstrip(".")) from None


def renamed(error: ArgumentError, argument: str) -> ArgumentError:
    """An error of an argument by another name."""
    return ArgumentError(argument, error.got, error.expected, error.cure)


@contextmanager
def errors_of(path: str | Path) -> Generator[None]:
    """Errors name a file, and the line in it that sets their argument."""
    try:
        yield
    except FileError:
        raise
    except ArgumentError as error:
        name = _in_file(error.argument)
        line = line_of(path, name)
        while line is None and "." in name:
            name = name.rpartition(".")[0]
            line = line_of(path, name)
        place = f"{path}, line {line}" if line else f"{path}"
        raise renamed(error, f"{place}: {error.argument}") from None


def _in_file(argument: str) -> str:
    """Dotted name in a file of what an argument of a `Campaign` is called."""
    name = argument.partition(":")[0]
    return f"campaign.{name}" if name.partition(".")[0] in SETTINGS else name
