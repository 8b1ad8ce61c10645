"""Tunings from TOML files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rumo.campaigns.reading import checked_tables, errors_of, varied_of, within
from rumo.campaigns.rehearsal import rehearse
from rumo.campaigns.specification import Campaign
from rumo.campaigns.tuning.specification import Check, Tuning
from rumo.errors import ArgumentError, UnknownNameError
from rumo.scenarios import Recipe
from rumo.scenarios.files import flattened, read_tables

TABLES = ("tune", "scenario", "search", "over", "objectives", "limits", "check")
SETTINGS = ("trials", "runs", "controller", "sampler", "seed", "batch", "storage", "timeout")
"""Keys of the table `[tune]`."""
CHECKS = ("runs", "vary", "scenario")


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
    with errors_of(path):
        tuning = tuning_of(read_tables(path), Path(path).parent)
        rehearse(tuning.drives)
        with within("search"):
            rehearse(Campaign(tuning.drives.recipe, tuning.search, runs=1_000, controllers=(tuning.controller,)))
        return tuning


def tuning_of(tables: Mapping[str, Any], folder: Path = Path()) -> Tuning:
    """A tuning from plain data, as a file has it; names of files in it are relative to a folder."""
    checked_tables(tables, TABLES)
    settings = dict(tables.get("tune", {}))
    for name in settings:
        if name not in SETTINGS:
            raise UnknownNameError(f"tune.{name}", name, SETTINGS)
    with within("scenario"):
        recipe = Recipe.of(tables.get("scenario"), folder)
    search, over = varied_of(tables.get("search", {}), "search"), varied_of(tables.get("over", {}), "over")
    check = _check(tables["check"]) if "check" in tables else None
    with within("tune", but=TABLES):
        return Tuning(
            recipe,
            search,
            over,
            tables.get("objectives", {}),
            tables.get("limits", {}),
            check=check,
            **settings,
        )


def _check(table: Mapping[str, Any]) -> Check:
    for name in table:
        if name not in CHECKS:
            raise UnknownNameError(f"check.{name}", name, CHECKS)
    scenario = table.get("scenario", {})
    if not isinstance(scenario, Mapping):
        raise ArgumentError("check.scenario", repr(scenario), "a table of settings")
    return Check(varied_of(table.get("vary", {}), "check.vary"), table.get("runs"), flattened(scenario))
