"""A campaign that goes on in the folder in which it was begun, asked for less or judged otherwise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from rumo.campaigns.specification.asked import kpi_name
from rumo.campaigns.specification.campaign import Campaign
from rumo.campaigns.store import read_head
from rumo.campaigns.store.store import HEAD
from rumo.errors import ArgumentError
from rumo.studies.kpis import KPIS
from rumo.version import __version__


def as_begun(campaign: Campaign, folder: str | Path) -> Campaign:
    """The campaign with all figures of merit that rows in its folder have, if it asks for no others.

    Figures belong to what decides a row, so that one cannot lack what another has. A campaign that goes on asks for
    those that it was begun with; whatever judges them may be another.

    Parameters
    ----------
    campaign : Campaign
        What is to be driven.
    folder : str or Path
        Where; it need not be there. One of another campaign is for `Store` to refuse.

    Raises
    ------
    ArgumentError
        If it is this campaign, but for a figure of merit that its rows do not have.
    """
    if not (Path(folder) / HEAD).exists():
        return campaign
    head = read_head(folder)
    kept: tuple[str, ...] = tuple(head["specification"].get("campaign", {}).get("kpis") or ())
    if head["rumo"] != __version__ or not kept or any(name not in KPIS for name in kept):
        return campaign
    missing = [name for name in campaign.kpis or () if name not in kept]
    if not missing:
        return replace(campaign, kpis=kept)
    if _apart_from_figures(campaign.identity) == _apart_from_figures(head.get("identity", {})):
        raise _unknown(campaign, missing[0], kept, folder)
    return campaign


def _apart_from_figures(identity: Mapping[str, Any]) -> dict[str, Any]:
    settings = {name: value for name, value in identity.get("campaign", {}).items() if name != "kpis"}
    return {**identity, "campaign": settings}


def _unknown(campaign: Campaign, missing: str, kept: tuple[str, ...], folder: str | Path) -> ArgumentError:
    """An error of a figure of merit that rows do not have: of the criterion that asks for it, if one does."""
    of_criteria = {kpi_name(each.kpi, "kpi"): name for name, each in campaign.criteria.items()}
    by_criterion = missing in of_criteria
    argument = f"criteria.{of_criteria[missing]}.kpi" if by_criterion else "kpis"
    got = campaign.criteria[of_criteria[missing]].kpi if by_criterion else missing
    known = [KPIS[name].key if by_criterion else name for name in kept]
    cure = "Name another folder for the campaign: all of its runs have to be made to know it."
    return ArgumentError(
        argument, f"{got!r}, which the rows in '{folder}' do not have", f"one of {', '.join(known)}", cure
    )
