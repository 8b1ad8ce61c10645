"""Files among the values of what varies: vehicles, tracks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from rumo.campaigns.specification.distributions import Choice, Distribution
from rumo.campaigns.specification.sampling import Grid
from rumo.scenarios import Recipe

Varied = Grid | Distribution


def with_files(vary: Mapping[str, Varied], recipe: Recipe, folder: Path = Path()) -> dict[str, Varied]:
    """What varies, in which files that lie in a folder have their whole paths.

    Parameters
    ----------
    vary : mapping of str to Grid or Distribution
        By setting.
    recipe : Recipe
        Whose base says which settings may name files.
    folder : Path
        That of the file in which all this is said; the current one if not given.
    """
    found = dict(vary)
    for name, each in vary.items():
        values = _listed(each)
        if values is None or not recipe.names_files(name):
            continue
        there: Any = recipe.located({name: values}, folder)[name]
        if there != values:
            found[name] = replace(each, among=there) if isinstance(each, Choice) else Grid(there)
    return found


def files_among(vary: Mapping[str, Varied], recipe: Recipe) -> set[str]:
    """Files that what varies may be."""
    listed = {name: _listed(each) for name, each in vary.items()}
    return recipe.files_in({name: values for name, values in listed.items() if values is not None})


def by_content(vary: Mapping[str, Varied], recipe: Recipe, digests: dict[str, str]) -> dict[str, Any]:
    """What varies as plain data, with what is in files for their names; see `Recipe.by_content`."""
    found: dict[str, Any] = {}
    for name, each in vary.items():
        values = _listed(each)
        plain: Any = each.plain
        if values is not None:
            content = recipe.by_content({name: values}, digests)[name]
            plain = {**plain, "among": content} if isinstance(each, Choice) else content
        found[name] = plain
    return found


def _listed(each: Varied) -> list[Any] | None:
    """Values that are told one by one."""
    if isinstance(each, Choice):
        return list(each.among)
    return list(each.values) if isinstance(each, Grid) and not isinstance(each.values, range) else None
