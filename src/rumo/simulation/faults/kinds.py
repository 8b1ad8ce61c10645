"""All kinds of faults by name, to make them from plain data."""

from __future__ import annotations

from dataclasses import MISSING, fields
from typing import Any

from rumo.errors import ArgumentError, UnknownNameError
from rumo.simulation.faults.actuators import Biased, Saturated, Slow, Stuck, Weakened
from rumo.simulation.faults.base import Fault
from rumo.simulation.faults.clock import LateCommand, LostCommand, SkippedSample
from rumo.simulation.faults.outliers import Outliers
from rumo.simulation.faults.plant import Changed, Disturbed
from rumo.simulation.faults.sensors import (
    Drift,
    Dropout,
    Frozen,
    LateMeasurement,
    Missing,
    Noisy,
    Offset,
    Reading,
    Scaled,
    Swapped,
)
from rumo.simulation.faults.solver import Budget, Misinformed

KINDS: dict[str, type[Fault]] = {
    "biased": Biased,
    "budget": Budget,
    "changed": Changed,
    "disturbed": Disturbed,
    "drift": Drift,
    "dropout": Dropout,
    "frozen": Frozen,
    "late-command": LateCommand,
    "late-measurement": LateMeasurement,
    "lost-command": LostCommand,
    "misinformed": Misinformed,
    "missing": Missing,
    "noisy": Noisy,
    "offset": Offset,
    "outliers": Outliers,
    "reading": Reading,
    "saturated": Saturated,
    "scaled": Scaled,
    "skipped-sample": SkippedSample,
    "slow": Slow,
    "stuck": Stuck,
    "swapped": Swapped,
    "weakened": Weakened,
}
"""Kinds of faults, by name."""


def make_fault(kind: str, when: range | tuple[float, float], **settings: Any) -> Fault:
    """A fault from plain data, such as a line of a file: `make_fault("offset", range(5), signal="p_y", by=5.0)`.

    Parameters
    ----------
    kind : str
        A name in `KINDS`.
    when : range, or (float, float)
        The bad samples, counted from 0; or the time from which, and until which, samples are bad [s].
    settings
        Further parameters of that kind.

    Raises
    ------
    ArgumentError
        If the kind or a setting is unknown, a setting is missing, or a value cannot be.
    """
    if kind not in KINDS:
        raise UnknownNameError("kind", kind, KINDS)
    known = {item.name: item for item in fields(KINDS[kind]) if item.name != "when" and item.init}
    for name in settings:
        if name not in known:
            raise UnknownNameError(f"make_fault({kind!r})", name, known)
    for name, item in known.items():
        if name not in settings and item.default is MISSING and item.default_factory is MISSING:
            raise ArgumentError(f"make_fault({kind!r})", f"no {name}", f"a value for each of {', '.join(known)}")
    return KINDS[kind](when, **settings)
