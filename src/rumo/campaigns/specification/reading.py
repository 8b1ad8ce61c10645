"""Campaigns from files: their tables, and errors that say where in a file something is wrong."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rumo.campaigns.specification.distributions import DISTRIBUTION, Distribution, distribution_of
from rumo.campaigns.specification.files import with_files
from rumo.campaigns.specification.sampling import Grid
from rumo.checks import a_name
from rumo.errors import ArgumentError, FileError, UnknownNameError
from rumo.scenarios import Recipe
from rumo.scenarios.files import line_of, require_once

TABLES = ("campaign", "scenario", "vary", "criteria", "report")
SETTINGS = ("runs", "controllers", "sampling", "seed", "timeout", "kpis", "logs")
"""Keys of the table `[campaign]`."""
VARIED = "a list, { from = ..., to = ... }, or { distribution = ..., ... }"
"""What may vary."""


def campaign_arguments(tables: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Arguments of a `Campaign` from plain data, as a file has it; names of files in it are relative to a folder."""
    check_tables(tables, TABLES)
    settings = settings_in(tables, "campaign", SETTINGS)
    for name in ("controllers", "kpis"):
        if name in settings:
            if not isinstance(settings[name], list):
                raise ArgumentError(f"campaign.{name}", repr(settings[name]), 'a list such as ["rti", "ltv"]')
            settings[name] = tuple(settings[name])
    with within("scenario"):
        recipe = Recipe.of(tables.get("scenario"), folder)
    others = {name: tables.get(name, {}) for name in ("criteria", "report")}
    return {"recipe": recipe, "vary": varied_in(tables, "vary", recipe, folder), **others, **settings}


def check_tables(tables: Mapping[str, Any], known: Sequence[str]) -> None:
    """Raise unless all tables of a file are known ones, and tables."""
    for name in tables:
        if name not in known:
            raise UnknownNameError(name, name, known)
        if not isinstance(tables[name], Mapping):
            raise ArgumentError(name, repr(tables[name]), f"a table: [{name}]")


def settings_in(tables: Mapping[str, Any], table: str, known: Sequence[str]) -> dict[str, Any]:
    """What a table of known keys says."""
    settings = dict(tables.get(table, {}))
    for name in settings:
        if name not in known:
            raise UnknownNameError(f"{table}.{name}", name, known)
    return settings


def varied_in(tables: Mapping[str, Any], table: str, recipe: Recipe, folder: Path) -> dict[str, Grid | Distribution]:
    """Grids and distributions of a table, by dotted names; names of files are relative to a folder."""
    found: dict[str, Grid | Distribution] = {}
    for name, values in _varied(tables.get(table, {}), "", table):
        for part in name.split("."):
            a_name(part, table)
        with within(table):
            require_once((name,), found)
        found[name] = values
    return with_files(found, recipe, folder)


def _varied(values: Mapping[str, Any], prefix: str, table: str) -> Generator[tuple[str, Grid | Distribution]]:
    for key, value in values.items():
        name = f"{prefix}{key}"
        with within(f"{table}.{name}"):
            if isinstance(value, list):
                yield name, Grid(value)
            elif not isinstance(value, Mapping):
                raise ArgumentError("", repr(value), VARIED, "What does not vary belongs to [scenario].")
            elif not value:
                raise ArgumentError("", "an empty table", VARIED, "Or leave it out.")
            elif DISTRIBUTION in value:
                yield name, distribution_of(value)
            elif "from" in value or "to" in value:
                yield name, Grid.of(value)
        if isinstance(value, Mapping) and not {DISTRIBUTION, "from", "to"} & value.keys():
            yield from _varied(value, f"{name}.", table)


@contextmanager
def within(table: str) -> Generator[None]:
    """Errors name the table in which their argument is."""
    try:
        yield
    except ArgumentError as error:
        if error.argument.partition(".")[0] == table:
            raise
        raise renamed(error, f"{table}.{error.argument}".rstrip(".")) from None


def renamed(error: ArgumentError, argument: str) -> ArgumentError:
    """An error of an argument by another name."""
    return ArgumentError(argument, error.got, error.expected, error.cure)


@contextmanager
def errors_of(path: str | Path, table: str = "campaign", settings: Sequence[str] = SETTINGS) -> Generator[None]:
    """Errors name a file, and the line in it that sets their argument, one of the settings of a table perhaps."""
    try:
        yield
    except FileError:
        raise
    except ArgumentError as error:
        name = error.argument.partition(":")[0]
        name = f"{table}.{name}" if name.partition(".")[0] in settings else name
        line = line_of(path, name)
        while line is None and "." in name:
            name = name.rpartition(".")[0]
            line = line_of(path, name)
        place = f"{path}, line {line}" if line else f"{path}"
        raise renamed(error, f"{place}: {error.argument}") from None
