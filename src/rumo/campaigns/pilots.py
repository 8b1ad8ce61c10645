"""What the first runs of a campaign say of all: how long they take, and whether they can be judged as is asked."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import islice
from typing import Any

from rumo.campaigns.judging.columns import KPI, RUN, column_of, key_of
from rumo.campaigns.judging.criteria import Criterion
from rumo.campaigns.specification import Campaign
from rumo.campaigns.standing import in_words
from rumo.campaigns.tasks.rows import DONE
from rumo.campaigns.tasks.task import Row
from rumo.errors import ArgumentError

DRAWS = 2
"""Draws that are driven first, by each controller: the first one sets up what the others share."""
TIME = f"{RUN}wall_time_s"
MOST_SECONDS = 3600.0
"""Estimates above this have to be agreed to."""


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
    """Raise for a criterion of a part that figures of merit do not have, or without one that they do."""
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


def _is_known(value: Any) -> bool:
    return value is not None and value == value
