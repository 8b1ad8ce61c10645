"""Drives in rounds: each round's settings are decided by what came of those before."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing
from math import inf
from typing import Any

from rumo.campaigns.specification import Campaign
from rumo.campaigns.store import Store
from rumo.campaigns.tasks.rows import DONE
from rumo.campaigns.tasks.task import Engine, Row
from rumo.campaigns.work import WORK
from rumo.interrupts import interruptible
from rumo.scenarios import Plain


class Rounds:
    """Drives the same draws of a campaign with other settings again and again; what was driven once is not again.

    Parameters
    ----------
    campaign : Campaign
        Its draws, each of which is driven by its first controller.
    engine : Engine
        Where they are driven.
    store : Store
        Of their rows.
    """

    def __init__(self, campaign: Campaign, engine: Engine, store: Store) -> None:
        self._campaign, self._engine, self._store = campaign, engine, store
        self._known: dict[str, Row] = {str(row["key"]): row for row in store.rows().to_dict("records")}

    def drive(self, proposals: Sequence[Mapping[str, Plain]]) -> list[list[Row]]:
        """Drive all draws with each of some settings.

        Parameters
        ----------
        proposals : sequence of mapping
            Settings on top of the campaign's.

        Returns
        -------
        list of list of dict
            Rows of each proposal, by draw.

        Raises
        ------
        CampaignError
            If no more can be carried out, or stored.
        """
        campaign, (controller, *_) = self._campaign, self._campaign.controllers
        draws = range(len(campaign.draws))
        wanted = [[campaign.task(draw, controller, further) for draw in draws] for further in proposals]
        missing: dict[str, Any] = {
            task["key"]: task for tasks in wanted for task in tasks if task["key"] not in self._known
        }
        try:
            with closing(
                self._engine.rows(WORK, campaign.common, list(missing.values()), self._store.flush_in_time)
            ) as rows:
                for row in rows:
                    self._store.add(row)
                    self._known[row["key"]] = {name: value for name, value in row.items() if name != "log"}
        finally:
            with interruptible(inf):
                self._store.flush()
        return [[self._known[task["key"]] for task in tasks] for tasks in wanted]

    def known(self, further: Mapping[str, Plain]) -> list[Row]:
        """Rows of all draws with some settings; none unless all have been driven here."""
        campaign, (controller, *_) = self._campaign, self._campaign.controllers
        keys = [campaign.task(draw, controller, further)["key"] for draw in range(len(campaign.draws))]
        return [self._known[key] for key in keys] if all(key in self._known for key in keys) else []

    @property
    def failed(self) -> list[Row]:
        """Rows of all drives that did not come to their end, whatever the settings."""
        return [row for row in self._known.values() if row["outcome"] != DONE]
