"""What the first runs of a campaign say of all: how long they take, and whether they can be judged as is asked."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from itertools import islice
from typing import Any

from rumo.campaigns.judging.columns import KPI, RUN, column_of, key_of
from rumo.campaigns.judging.criteria import Criterion
from rumo.campaigns.specification import Campaign
from rumo.campaigns.standing import in_words
from rumo.campaigns.tasks.rows import DONE
from rumo.campaigns.tasks.task import Row
from rumo.errors import ArgumentError
from rumo.studies.kpis import KPIS, PLACE, POINT

DRAWS = 2
"""Draws that are driven first, by each controller: the first one sets up what the others share."""
TIME = f"{RUN}wall_time_s"
MOST_SECONDS = 3600.0
"""Estimates above this have to be agreed to."""
NEEDS = {KPIS[name].key: (KPI + KPIS["tracking_error_rms"].key, "they follow no point p_x, p_y") for name in POINT} | {
    KPIS[name].key: (KPI + KPIS["distance"].key, "they are along no path") for name in PLACE
}
"""Figures of merit that need something, with one that all drives have which have it, and what is said of the others."""


def pilots(campaign: Campaign) -> list[Any]:
    """The first tasks."""
    return [*islice(campaign.tasks, DRAWS * len(campaign.controllers))]


def require_short(campaign: Campaign, rows: Sequence[Row], left: int, workers: int) -> None:
    """Raise where all runs take longer than an hour by those that are done.

    Parameters
    ----------
    campaign : Campaign
        Whose runs.
    rows : sequence of dict
        Of its pilots.
    left : int
        How many runs are to be made, by all controllers.
    workers : int
        How many runs are made at the same time.
    """
    seconds = 0.0
    for name in campaign.controllers:
        driven = [row for row in rows if row["controller"] == name]
        ended = [row for row in driven if row["outcome"] == DONE]
        times = [row[TIME] for row in ended or driven if _is_known(row.get(TIME))]
        if times:
            seconds += min(times) * left / len(campaign.controllers) / workers
    if seconds > MOST_SECONDS:
        raise ArgumentError(
            "runs",
            f"{len(campaign.draws)}, which would take about {in_words(seconds)} with {workers} at a time",
            f"at most {in_words(MOST_SECONDS)}",
            "If it is meant, say --yes (from Python yes=True); the runs that were timed are kept.",
        )


def require_known(criteria: Iterable[Criterion], rows: Sequence[Row]) -> None:
    """Raise for a criterion of a figure of merit, or a part of one, that no drive like these has.

    What a drive may have if it is longer, or goes on to the end of its lap, is not among these.

    Parameters
    ----------
    criteria : iterable of Criterion
        By which runs are to be judged.
    rows : sequence of dict
        Of the pilots.
    """
    ended = [row for row in rows if row["outcome"] == DONE]
    known = sorted({name for row in ended for name in row if name.startswith((KPI, RUN)) and _is_known(row[name])})
    for criterion in criteria:
        if column_of(criterion.kpi, known) is not None:
            continue
        head, _, part = criterion.kpi.partition(".")
        parts = [key_of(name) for name in known if key_of(name).startswith(f"{head}.")]
        if parts:
            raise ArgumentError(f"criteria.{criterion.name}.kpi", repr(criterion.kpi), f"one of {', '.join(parts)}")
        if part and column_of(head, known) is not None:
            raise ArgumentError(f"criteria.{criterion.name}.kpi", repr(criterion.kpi), f"{head}, which has no parts")
        needs, lacking = NEEDS.get(head, ("", ""))
        if any(needs in row for row in ended) and needs not in known:
            figures = [key_of(name) for name in known if name.startswith(KPI)]
            raise ArgumentError(
                f"criteria.{criterion.name}.kpi",
                f"{criterion.kpi!r}, which these drives do not have: {lacking}",
                f"one of {', '.join(get_close_matches(criterion.kpi, figures, n=len(figures), cutoff=0.0))}",
                "Judge them by one of these, or take the criterion away; the runs that were made are kept.",
            )


def _is_known(value: Any) -> bool:
    return value is not None and value == value
