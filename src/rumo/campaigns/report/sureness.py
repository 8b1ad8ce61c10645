"""How sure the report is: what its intervals are made for, and how far that is so here."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import prod
from typing import Any

from rumo.campaigns.judging.results import Results
from rumo.campaigns.judging.statistics import RESAMPLES, SMALLEST
from rumo.campaigns.specification.distributions import DISTRIBUTION
from rumo.campaigns.specification.sampling import Grid
from rumo.report.contents import Item, Section
from rumo.report.tables import number

SPREAD = {"sobol": "by Sobol's sequence", "latin-hypercube": "in a Latin hypercube"}
"""Samplings whose draws are not independent of each other, for readers."""


def sureness(content: Mapping[str, Any], results: Results, told: Iterable[Mapping[str, Any]]) -> Section | None:
    """What intervals and correlations are made for; None if the report has none.

    Parameters
    ----------
    content : mapping
        The summary.
    results : Results
        What it is of.
    told : iterable of mapping
        What the campaigns were told, as plain data.
    """
    items: list[Item] = []
    if results.criteria:
        items.append(" ".join(dict.fromkeys(sentence for each in told for sentence in _shares(each))))
    if content.get("unpaired") or any(found["draws"] >= SMALLEST for found in content["comparisons"]):
        items.append(
            "An interval of a mean difference is a bootstrap interval of 95 %: the draws were resampled "
            f"{number(RESAMPLES)} times. It says how far the mean may be off for want of draws, if these are "
            "independent; it is approximate, and too narrow where a few draws decide the mean. It says nothing of what "
            "did not vary. No interval is corrected for how many there are."
        )
    if results.numeric and len(results.rows) >= SMALLEST:
        items.append(
            "Rank correlations are judged one by one as well: of a hundred settings on which nothing depends, about "
            "one would be without brackets."
        )
    return Section("How sure it is", items) if items else None


def _shares(told: Mapping[str, Any]) -> list[str]:
    """Of shares of runs of a campaign, and of how it has chosen its draws."""
    vary, sampling = told.get("vary", {}), told.get("campaign", {}).get("sampling")
    by_chance = [name for name, each in vary.items() if isinstance(each, Mapping) and DISTRIBUTION in each]
    points = prod(_points(each) for name, each in vary.items() if name not in by_chance)
    words = ["An interval of a share of runs is Wilson's score interval of 95 %, which is made for independent draws."]
    if by_chance and sampling in SPREAD:
        words.append(
            f"Draws {SPREAD[sampling]} are spread more evenly than independent ones: as a rule it is then too wide "
            "rather than too narrow, which nothing guarantees."
        )
    if by_chance and points > 1:
        words.append(
            f"All points of the grid are driven with the same values of {', '.join(by_chance)}: runs that have these "
            "in common tend to pass or fail together, and as far as they do, it is too narrow."
        )
    elif points > 1:
        words.append(
            "Points of a grid were chosen and not drawn: it says what chance does at these, and nothing of others."
        )
    return words


def _points(grid: Any) -> int:
    return len((Grid.of(grid) if isinstance(grid, Mapping) else Grid(grid)).values)
