"""Controllers that are there already: one for all runs whose problems differ in numbers alone."""

from __future__ import annotations

import hashlib
import os
import pickle
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import lru_cache
from inspect import signature
from threading import get_ident
from typing import Any
from weakref import WeakKeyDictionary

from rumo.checks import as_mapping
from rumo.controllers import Controller
from rumo.controllers.settings import changed
from rumo.problem import Problem
from rumo.registry import CONTROLLERS
from rumo.simulation import Scenario
from rumo.structure import Structure

MOST = 8
"""Controllers that are kept: those asked for last."""
_KINDS: WeakKeyDictionary[Structure, object] = WeakKeyDictionary()
"""What is known to be the same for problems of a structure."""


def shared_controller(scenario: Scenario) -> Controller:
    """A controller as a scenario wants it, made once in a thread for all problems that differ in numbers alone.

    To make one takes longer than many a drive. One that is there already takes the numbers of the scenario's problem,
    and its settings: in a run, which resets it first, it drives as a new one does, to the last bit.
    """
    wanted = _Wanted.of(scenario)
    controller = _made(wanted)
    numbers = scenario.problem.numbers
    if controller.problem.numbers is not numbers:
        controller.renumber(numbers)
    if wanted.changes is not None:
        kind = type(controller.settings)
        settings = changed(kind(), wanted.changes, kind)
        if settings != controller.settings:
            controller.settings = settings
    return controller


@dataclass(frozen=True)
class _Wanted:
    """A scenario, as far as it decides what controller there is, and whose it is.

    Attributes
    ----------
    key : tuple
        All that a controller is made of and does not change.
    changes : dict or None
        Settings that it can change, by name; None if nothing is known of its settings.
    """

    scenario: Scenario = field(compare=False)
    key: tuple[object, ...]
    changes: dict[str, Any] | None = field(compare=False)

    @classmethod
    def of(cls, scenario: Scenario) -> _Wanted:
        made, changes = _parted(scenario)
        backend = scenario.backend or os.environ.get("RUMO_BACKEND")
        wanted = (scenario.controller, scenario.discretization, backend, made)
        return cls(scenario, (get_ident(), _kind_of(scenario.problem), *wanted), changes)


def _parted(scenario: Scenario) -> tuple[object, dict[str, Any] | None]:
    """Settings that a controller is made with for good, hashable; and others that it can change."""
    settings, kind = scenario.settings, scenario.controller
    if not (isinstance(kind, str) and (isinstance(settings, Mapping) or settings is None)):
        return (tuple(settings.items()) if isinstance(settings, Mapping) else settings), None
    given = as_mapping(settings, "settings")
    defaults = signature(CONTROLLERS[kind]).parameters["settings"].default
    can = {each.name for each in fields(defaults)}
    changes = {name: value for name, value in given.items() if name in can}
    made = {name: value for name, value in given.items() if name not in can}
    # How the core goes about the horizon is chosen for good when it is made.
    qp = changes.get("qp", getattr(defaults, "qp", None))
    return (*made.items(), getattr(qp, "solver", None)), changes


def _kind_of(problem: Problem) -> object:
    """What is the same for problems that differ in numbers alone, however they were made."""
    structure = problem.structure
    if structure not in _KINDS:
        try:
            _KINDS[structure] = hashlib.sha256(pickle.dumps(problem.without_numbers())).digest()
        except Exception:
            return structure
    return _KINDS[structure]


@lru_cache(maxsize=MOST)
def _made(wanted: _Wanted) -> Controller:
    return wanted.scenario.make_controller()
