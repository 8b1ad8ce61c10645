"""Whether all drives of a campaign can begin, found out before any does."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing
from typing import Any

from rumo.campaigns.specification import SEED, Campaign
from rumo.campaigns.work import scenario_of, with_controller
from rumo.controllers import RealTimeIteration
from rumo.errors import ArgumentError, RumoError
from rumo.registry import CONTROLLERS
from rumo.scenarios import Plain, changed
from rumo.simulation import ClosedLoop
from rumo.studies.base import shared_controller

MOST = 50
"""Values of a setting that are tried, where all are ends."""


def rehearse(campaign: Campaign) -> None:
    """Begin the first drive with each controller, and drives with each varied setting at its extremes.

    Extremes are the ends of a distribution or grid, and where there are none, what the draws have. Other settings are
    those of the first draw. Each drive is set up and comes to its first sample, and no further.

    Raises
    ------
    ArgumentError
        If one cannot begin; the message begins with "scenario." or "vary." and the setting's name.
    """
    first = campaign.settings(0)
    for name in campaign.controllers:
        _begin(campaign, first, name, None)
    for setting in campaign.vary:
        for value in campaign.draws.extremes(setting)[:MOST]:
            if value != first[setting]:
                _begin(campaign, {**first, setting: value}, campaign.controllers[0], setting)


def _begin(campaign: Campaign, settings: Mapping[str, Plain], controller: str, tried: str | None) -> None:
    try:
        begin(with_controller(campaign.recipe.with_settings(settings).run(), controller))
    except ArgumentError as error:
        raise _told(error, campaign, settings, tried) from None
    except RumoError as error:
        raise ArgumentError(
            _place(campaign, tried), _value(settings, tried), "a drive that begins", str(error)
        ) from None
    except Exception as error:  # of a base of the user's
        got = f"{_value(settings, tried)}, with which {campaign.recipe.base} raises {type(error).__name__}: {error}"
        raise ArgumentError(_place(campaign, tried), got, "a base that makes a run") from error


def begin(run: Any) -> None:
    """Set up a run, and come to its first sample."""
    scenario = scenario_of(run)
    if scenario is None:
        return
    kind = CONTROLLERS.get(scenario.controller) if isinstance(scenario.controller, str) else scenario.controller
    if kind is RealTimeIteration and scenario.backend in (None, "auto", "tailored"):
        scenario = changed(scenario, {"backend": "portable"})  # the same, without a compiler
    with closing(ClosedLoop(scenario, shared_controller(scenario)).moments()) as moments:
        next(moments)


def _told(error: ArgumentError, campaign: Campaign, settings: Mapping[str, Plain], tried: str | None) -> ArgumentError:
    """An error by the name that the campaign has for what is wrong."""
    own = {*settings, *campaign.recipe.settings}
    name = next((each for each in sorted(own, key=len, reverse=True) if _is_of(error.argument, each)), tried)
    if name is None or (tried is not None and name != tried):
        name = tried
    if name is None:
        return ArgumentError(f"scenario: {error.argument}", error.got, error.expected, error.cure)
    place = f"vary.{name}" if name in campaign.vary else f"scenario.{name}"
    if name == SEED and name not in campaign.vary and name not in campaign.recipe.settings:
        place = "campaign.seed"
    detail = error.argument[len(name) :] if error.argument.startswith(name) else f": {error.argument}"
    value = settings[name] if name in settings else campaign.recipe.settings[name]
    got = error.got if error.argument.startswith(name) else f"{value!r} ({error.argument} {error.got})"
    return ArgumentError(f"{place}{detail}" if detail[:1] in ("", ".") else place, got, error.expected, error.cure)


def _is_of(argument: str, name: str) -> bool:
    return argument == name or argument.startswith((f"{name}.", f"{name}:"))


def _place(campaign: Campaign, tried: str | None) -> str:
    return "scenario" if tried is None else f"vary.{tried}"


def _value(settings: Mapping[str, Plain], tried: str | None) -> str:
    return "these settings" if tried is None else repr(settings[tried])
