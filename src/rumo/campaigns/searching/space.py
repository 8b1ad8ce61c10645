"""What may be chosen in a search."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rumo.campaigns.searching.samplers import CMA_ES
from rumo.campaigns.specification.distributions import Choice, Distribution, Integers, LogUniform, Uniform
from rumo.campaigns.specification.files import digests_of
from rumo.campaigns.specification.sampling import Grid
from rumo.errors import ArgumentError
from rumo.scenarios import Recipe
from rumo.scenarios.differences import CONTENT
from rumo.scenarios.settings import LEAVES

SEARCHED = (Uniform, Integers, Choice, Grid)
"""What can be searched; LogUniform is Uniform."""


def check_space(space: Mapping[str, Distribution | Grid], sampler: str = "tpe") -> None:
    """Raise unless everything can be searched, by the sampler."""
    for name, choice in space.items():
        values = options_of(choice)
        if not isinstance(choice, SEARCHED) or (values is not None and not _listed(values)):
            expected = "a list of numbers or texts, or a distribution with ends: uniform, log-uniform, integers"
            raise ArgumentError(f"search.{name}", repr(choice), expected)
        if values is not None and len(set(values)) < len(values):
            raise ArgumentError(f"search.{name}", repr(values), "each of them once")
        if values is not None and sampler == CMA_ES:
            cure = 'Sampler "tpe" can take it.'
            raise ArgumentError(f"search.{name}", f'a list beside sampler "{CMA_ES}"', "one between two ends", cure)
    if sampler == CMA_ES and len(space) < 2:
        raise ArgumentError("sampler", f'"{CMA_ES}" with one setting', "two settings at least", 'Or take "tpe".')


def identity_of(recipe: Recipe, space: Mapping[str, Distribution | Grid]) -> dict[str, Any]:
    """Plain data that differs if a recipe, or a file that may be chosen, holds something else.

    Where files are belongs to the space: storages know them by their names.
    """
    files: dict[str, Any] = {name: {CONTENT: content} for name, content in digests_of(space, recipe).items()}
    return {"recipe": recipe.identity, **({"files": files} if files else {})}


def options_of(choice: Distribution | Grid) -> list[Any] | None:
    """Values among which one is chosen; None where it is not among some."""
    if isinstance(choice, Choice):
        return list(choice.among)
    return list(choice.values) if isinstance(choice, Grid) else None


def as_chosen(choice: Distribution | Grid, value: Any) -> Any:
    """A value in the form in which it is chosen: whole numbers may be floats in a table, or have been scaled."""
    values = options_of(choice)
    if values is not None:
        return next((option for option in values if option == value), value)
    return round(value) if isinstance(choice, Integers) else value


def _listed(values: Sequence[Any]) -> bool:
    return all(isinstance(value, LEAVES) for value in values)


def suggest(trial: Any, name: str, choice: Distribution | Grid) -> None:
    """Have Optuna choose a setting of a trial."""
    values = options_of(choice)
    if values is not None:
        trial.suggest_categorical(name, values)
    elif isinstance(choice, Integers):
        trial.suggest_int(name, choice.low, choice.high)
    else:
        assert isinstance(choice, Uniform)
        trial.suggest_float(name, choice.low, choice.high, log=isinstance(choice, LogUniform))
