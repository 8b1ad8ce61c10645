"""Campaigns from TOML files."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rumo.campaigns.distributions import DISTRIBUTION, Distribution, distribution_of
from rumo.campaigns.rehearsal import rehearse
from rumo.campaigns.sampling import Grid
from rumo.campaigns.specification import Campaign
from rumo.errors import ArgumentError, UnknownNameError
from rumo.scenarios import Recipe
from rumo.scenarios.files import line_of, read_tables

TABLES = ("campaign", "scenario", "vary", "criteria", "report")
SETTINGS = ("runs", "controllers", "sampling", "seed", "timeout", "kpis", "logs")
"""Keys of the table `[campaign]`."""


def read_campaign(path: str | Path) -> Campaign:
    """A campaign from a file, all of whose drives can begin.

    Parameters
    ----------
    path : str or Path
        Of a TOML file with tables `[campaign]`, `[scenario]`, `[vary]`, `[criteria]` and `[report]`.

    Raises
    ------
    ArgumentError
        If anything in it cannot work; the message names file, line, key, what is there and what could be.
    """
    with errors_of(path):
        campaign = campaign_of(read_tables(path), Path(path).parent)
        rehearse(campaign)
        return campaign


def campaign_of(tables: Mapping[str, Any], folder: Path = Path()) -> Campaign:
    """A campaign from plain data, as a file has it; names of files in it are relative to a folder."""
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
    vary = dict(_varied(tables.get("vary", {}), ""))
    with _within("campaign", but=TABLES):
        return Campaign(recipe, vary, criteria=tables.get("criteria", {}), report=tables.get("report", {}), **settings)


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
def _within(table: str, but: tuple[str, ...] = ()) -> Generator[None]:
    """Errors name the table in which their argument is."""
    try:
        yield
    except ArgumentError as error:
        if error.argument.partition(".")[0] in (*but, table):
            raise
        raise renamed(error, f"{table}.{error.argument}".rstrip(".")) from None


def renamed(error: ArgumentError, argument: str) -> ArgumentError:
    """An error of an argument by another name."""
    return ArgumentError(argument, error.got, error.expected, error.cure)


@contextmanager
def errors_of(path: str | Path, line: Callable[[str | Path, str], int | None] = line_of) -> Generator[None]:
    """Errors name a file, and the line in it that sets their argument."""
    try:
        yield
    except ArgumentError as error:
        if error.argument.startswith((str(path), "file")):
            raise
        name = error.argument.partition(":")[0]
        found = line(path, name)
        while found is None and "." in name:
            name = name.rpartition(".")[0]
            found = line(path, name)
        place = f"{path}, line {found}" if found else f"{path}"
        raise renamed(error, f"{place}: {error.argument}") from None
