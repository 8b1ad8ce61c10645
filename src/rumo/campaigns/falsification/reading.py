"""Falsifications from TOML files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rumo.campaigns.falsification.specification import Falsification
from rumo.campaigns.searching.specification import SETTINGS
from rumo.campaigns.specification.reading import check_tables, errors_of, settings_in, varied_in, within
from rumo.campaigns.tuning.reading import rehearse_search
from rumo.scenarios import Recipe
from rumo.scenarios.files import flattened, read_tables

TABLES = ("falsify", "scenario", "search", "size", "criteria")


def read_falsification(path: str | Path) -> Falsification:
    """A falsification from a file, all of whose drives can begin.

    Parameters
    ----------
    path : str or Path
        Of a TOML file with tables `[falsify]`, `[scenario]`, `[search]`, `[size]` and `[criteria]`.

    Raises
    ------
    ArgumentError
        If anything in it cannot work; the message names file, line, key, what is there and what could be.
    """
    with errors_of(path, "falsify", SETTINGS):
        falsification = falsification_of(read_tables(path), Path(path).parent)
        rehearse_falsification(falsification)
        return falsification


def rehearse_falsification(falsification: Falsification) -> None:
    """Begin drives at the ends of all that may be chosen."""
    rehearse_search(falsification.drives, falsification.search)


def falsification_of(tables: Mapping[str, Any], folder: Path = Path()) -> Falsification:
    """A falsification from plain data, as a file has it; names of files in it are relative to a folder."""
    check_tables(tables, TABLES)
    settings = settings_in(tables, "falsify", SETTINGS)
    with within("scenario"):
        recipe = Recipe.of(tables.get("scenario"), folder)
    size: Any = flattened(tables.get("size", {}))
    search = varied_in(tables, "search", recipe, folder)
    return Falsification(recipe, search, size, tables.get("criteria", {}), **settings)
