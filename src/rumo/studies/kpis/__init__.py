"""Figures of merit of a drive: one table of names, units and meanings for all studies."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from rumo.checks import known_names
from rumo.studies.kpis.base import Kpi
from rumo.studies.kpis.constraints import CONSTRAINTS
from rumo.studies.kpis.driven import Driven, driven
from rumo.studies.kpis.inputs import INPUTS
from rumo.studies.kpis.motion import MOTION
from rumo.studies.kpis.place import PLACE, POINT, SETTLED, heading_error, tracking_error
from rumo.studies.kpis.steps import STEPS

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "CONSTRAINTS",
    "DRIVING",
    "INPUTS",
    "KPIS",
    "MOTION",
    "PLACE",
    "POINT",
    "SETTLED",
    "STEPS",
    "Driven",
    "Kpi",
    "driven",
    "driving_kpis",
    "heading_error",
    "kpis",
    "tracking_error",
]

KPIS: Mapping[str, Kpi] = MappingProxyType({**POINT, **PLACE, **MOTION, **INPUTS, **CONSTRAINTS, **STEPS})
"""All of them, by name."""
DRIVING = (*POINT, "step_time", "deadline_misses", "status_counts")
"""What is said of drives after a point that moves on."""


def kpis(drive: Driven, names: Iterable[str] = tuple(KPIS)) -> dict[str, Any]:
    """Figures of merit by key, name and unit, such as `lateral_deviation_rms_m`; None where a drive does not say.

    Parameters
    ----------
    drive : Driven
        A log, and what else is known.
    names : iterable of str
        In `KPIS`; all if not given.

    Raises
    ------
    UnknownNameError
        If there is none of that name.
    """
    wanted = tuple(names)
    known_names(wanted, "names", KPIS)
    return {KPIS[name].key: KPIS[name].of(drive) for name in wanted}


def driving_kpis(log: xr.Dataset) -> dict[str, Any]:
    """What `summary.json` says of a controller that follows a point; None where the run is too short to say."""
    return kpis(Driven(log), DRIVING)
