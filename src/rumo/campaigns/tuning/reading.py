"""Tunings from TOML files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rumo.campaigns.searching.specification import SETTINGS as SEARCH_SETTINGS
from rumo.campaigns.specification import Campaign
from rumo.campaigns.specification.reading import check_tables, errors_of, renamed, settings_in, varied_in, within
from rumo.campaigns.specification.sampling import Grid
from rumo.campaigns.tuning.specification import Check, Tuning, named, own_settings
from rumo.errors import ArgumentError
from rumo.scenarios import Recipe
from rumo.scenarios.files import flattened, read_tables

TABLES = ("tune", "scenario", "search", "over", "objectives", "limits", "check")
SETTINGS = (*SEARCH_SETTINGS, "runs", "storage")
"""Keys of the table `[tune]`."""
CHECKS = ("runs", "vary", "scenario")
"""Keys of the table `[check]`."""


def read_tuning(path: str | Path) -> Tuning:
    """A tuning from a file, all of whose drives can begin.

    Parameters
    ----------
    path : str or Path
        Of a TOML file with tables `[tune]`, `[scenario]`, `[search]`, `[over]`, `[objectives]`, `[limits]`, `[check]`.

    Raises
    ------
    ArgumentError
        If anything in it cannot work; the message names file, line, key, what is there and what could be.
    """
    with errors_of(path, "tune", SETTINGS):
        return rehearsed(tuning_of(read_tables(path), Path(path).parent))


def tuning_of(tables: Mapping[str, Any], folder: Path = Path()) -> Tuning:
    """A tuning from plain data, as a file has it; names of files in it are relative to a folder."""
    check_tables(tables, TABLES)
    settings = settings_in(tables, "tune", SETTINGS)
    with within("scenario"):
        recipe = Recipe.of(tables.get("scenario"), folder)
    objectives, limits = tables.get("objectives", {}), tables.get("limits", {})
    search, over = (varied_in(tables, table, recipe, folder) for table in ("search", "over"))
    return Tuning(recipe, search, over, objectives, limits, check=_check(tables, recipe, folder), **settings)


def rehearsed(tuning: Tuning) -> Tuning:
    """A tuning all of whose drives can begin, those of the check as well."""
    with named("over"):
        rehearse_search(tuning.drives, tuning.search)
    if tuning.judged is not None and tuning.check is not None:
        try:
            with named("check.vary", "check.runs"):
                tuning.judged.rehearse()
        except ArgumentError as error:
            name = error.argument.removeprefix("scenario.")
            raise renamed(
                error, f"check.{error.argument}" if name in tuning.check.settings else error.argument
            ) from None
    return tuning


def rehearse_search(drives: Campaign, search: Mapping[str, Any]) -> None:
    """Begin drives at the ends of all that may be chosen."""
    drives.rehearse()
    for name, choice in search.items():
        own = own_settings(drives.recipe, drives.controllers[0], (name,)).values()
        with named("search"):
            Campaign(drives.recipe, {name: Grid([*own, *choice.ends])}, controllers=drives.controllers).rehearse()


def _check(tables: Mapping[str, Any], recipe: Recipe, folder: Path) -> Check | None:
    if "check" not in tables:
        return None
    table = settings_in(tables, "check", CHECKS)
    scenario = table.get("scenario", {})
    if not isinstance(scenario, Mapping):
        raise ArgumentError("check.scenario", repr(scenario), "a table of settings")
    with within("check"):
        settings = recipe.located(flattened(scenario), folder)
        return Check(varied_in(table, "vary", recipe, folder), table.get("runs"), settings)
