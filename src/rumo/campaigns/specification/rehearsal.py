"""Whether all drives of a campaign can begin, found out before any does."""

from __future__ import annotations

import re
from collections.abc import Generator, Mapping
from contextlib import closing, contextmanager
from typing import TYPE_CHECKING, Any

from rumo.campaigns.specification.distributions import Distribution
from rumo.campaigns.specification.sampling import SEED
from rumo.campaigns.work import scenario_of, task_run
from rumo.controllers import RealTimeIteration
from rumo.errors import ArgumentError, UnknownNameError
from rumo.registry import CONTROLLERS
from rumo.scenarios import Plain, changed
from rumo.scenarios.settings import blamed
from rumo.simulation import ClosedLoop
from rumo.studies.base import shared_controller

if TYPE_CHECKING:
    from rumo.campaigns.specification import Campaign

MOST = 50
"""Values of a setting that are tried, where all are ends."""


def rehearse(campaign: Campaign) -> None:
    """Begin the first drive with each controller, and drives with each varied setting at its extremes.

    Extremes are the ends of a distribution or grid, and where there are none, what the draws have. Other settings are
    those of the first draw. Each drive is set up and comes to its first sample, and no further; the first one with each
    controller takes its step there.

    Raises
    ------
    ArgumentError
        If one cannot begin; the message begins with "scenario." or "vary." and the setting's name.
    """
    with _told_of(campaign, campaign.draws[0], None):
        first = campaign.settings(0)
    for name in campaign.controllers:
        _begin(campaign, first, name, None, step=True)
    for setting in campaign.vary:
        for value in campaign.draws.extremes(setting)[:MOST]:
            if value != first[setting]:
                _begin(campaign, {**first, setting: value}, campaign.controllers[0], setting)


def begin(run: Any, *, step: bool = False) -> None:
    """Set up a run, and come to its first sample, or to what its controller says of it.

    Only misuse is an error of a step: whatever else it may raise is what comes of a run.
    """
    scenario = scenario_of(run)
    if scenario is None:
        return
    kind = CONTROLLERS.get(scenario.controller) if isinstance(scenario.controller, str) else scenario.controller
    if kind is RealTimeIteration and scenario.backend in (None, "auto", "tailored"):
        scenario = changed(scenario, {"backend": "portable"})  # the same, without a compiler
    with closing(ClosedLoop(scenario, shared_controller(scenario)).moments()) as moments:
        moment = next(moments)
        if step:
            try:
                moment.plan()
            except ArgumentError:
                raise
            except Exception:
                return


def _begin(
    campaign: Campaign, settings: Mapping[str, Plain], controller: str, tried: str | None, *, step: bool = False
) -> None:
    with _told_of(campaign, settings, tried):
        begin(task_run(campaign.common, {"controller": controller, "settings": settings}), step=step)


@contextmanager
def _told_of(campaign: Campaign, settings: Mapping[str, Plain], tried: str | None) -> Generator[None]:
    """Errors name the setting that is tried, or which of them it is."""
    try:
        yield
    except ArgumentError as error:
        raise _told(error, campaign, settings, tried) from None
    except Exception as error:  # of the plant, or of a base of the user's
        value = "these settings" if tried is None else repr(settings[tried])
        got = f"{value}, with which {campaign.recipe.base} raises {type(error).__name__}: {error}"
        raise ArgumentError("scenario" if tried is None else f"vary.{tried}", got, "a run that begins") from error


def _told(error: ArgumentError, campaign: Campaign, settings: Mapping[str, Plain], tried: str | None) -> ArgumentError:
    """An error by the name that the campaign has for what is wrong, and with its value."""
    every = dict(campaign.recipe.settings) | dict(settings)
    within = [name for name in every if re.match(rf"{re.escape(name)}(?!\w)", error.argument)]
    name = (max(within, key=len, default=None) or blamed(error, every)) if tried is None else tried
    if name is None:
        return ArgumentError(f"scenario: {error.argument}", error.got, error.expected, error.cure)
    if name in campaign.vary:
        place = f"vary.{name}"
    else:
        place = f"scenario.{name}" if name in campaign.recipe.settings or name != SEED else "campaign.seed"
    cure = error.cure
    drawn = isinstance(campaign.vary.get(name), Distribution) and every[name] not in campaign.vary[name].ends
    if drawn and not isinstance(error, UnknownNameError):
        cure = "Give the distribution ends, low and high."
    if name in within:  # perhaps of a part of it
        return ArgumentError(place + error.argument.removeprefix(name), error.got, error.expected, cure)
    return ArgumentError(place, f"{every[name]!r} ({error.argument}: {error.got})", error.expected, cure)
