"""Files among the values of what varies: vehicles, tracks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from rumo.campaigns.specification.distributions import Choice, Distribution
from rumo.campaigns.specification.sampling import Grid
from rumo.scenarios import Recipe
from rumo.scenarios.contents import by_content, located

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
    for name, values in _listed(vary, recipe).items():
        there: Any = located(values, folder)
        if there != values:
            each = vary[name]
            found[name] = replace(each, among=there) if isinstance(each, Choice) else Grid(there)
    return found


def digests_of(vary: Mapping[str, Varied], recipe: Recipe) -> dict[str, str]:
    """SHA-256 of files that what varies may be, by their names."""
    digests: dict[str, str] = {}
    for values in _listed(vary, recipe).values():
        by_content(values, digests)
    return dict(sorted(digests.items()))


def plain_by_content(vary: Mapping[str, Varied], recipe: Recipe, digests: dict[str, str]) -> dict[str, Any]:
    """What varies as plain data, with what is in files for their names; see `rumo.scenarios.contents.by_content`."""
    found: dict[str, Any] = {name: each.plain for name, each in vary.items()}
    for name, values in _listed(vary, recipe).items():
        content = by_content(values, digests)
        found[name] = {**found[name], "among": content} if isinstance(vary[name], Choice) else content
    return found


def _listed(vary: Mapping[str, Varied], recipe: Recipe) -> dict[str, list[Any]]:
    """Values that are told one by one, of what may name files."""
    found: dict[str, list[Any]] = {}
    for name in vary.keys() & recipe.naming_files:
        each = vary[name]
        if isinstance(each, Choice):
            found[name] = list(each.among)
        elif isinstance(each, Grid) and not isinstance(each.values, range):
            found[name] = list(each.values)
    return found
