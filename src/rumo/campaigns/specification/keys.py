"""Keys of runs: the hash of all that decides a row, as far as a campaign knows of it."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from typing import Any

from rumo.campaigns.store.store import FORMAT
from rumo.campaigns.tasks.task import canonical
from rumo.scenarios import Plain, Recipe
from rumo.scenarios.contents import by_content, files_in
from rumo.version import __version__


class Keys:
    """Tasks with keys, of runs of one recipe.

    Parameters
    ----------
    recipe : Recipe
        What the runs have in common.
    kpis : sequence of str
        Names of the figures of merit that rows have.

    Attributes
    ----------
    digests : dict of str to str
        SHA-256 of files that settings name, by their names, as they were when they were first asked for.
    """

    def __init__(self, recipe: Recipe, kpis: Sequence[str]) -> None:
        self.digests: dict[str, str] = {}
        self._naming_files = recipe.naming_files
        self._common = {"format": FORMAT, "rumo": __version__, "recipe": recipe.identity, "kpis": sorted(kpis)}

    def task(self, draw: int, controller: str, settings: Mapping[str, Plain]) -> dict[str, Any]:
        """The task of a run with settings on top of the recipe's."""
        named = {name: settings[name] for name in self._naming_files & settings.keys()}
        content = {**settings, **{name: by_content(value, self.digests) for name, value in named.items()}}
        decided = {**self._common, "settings": content, "controller": controller, "draw": draw}
        key = hashlib.sha256(canonical(decided).encode()).hexdigest()[:16]
        task: dict[str, Any] = {"key": key, "draw": draw, "controller": controller, "settings": dict(settings)}
        files = {name: self.digests[name] for name in sorted(files_in([*named.values()], self.digests))}
        return task | ({"files": files} if files else {})
