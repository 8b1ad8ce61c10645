"""What a figure of merit is: a name, a unit, a meaning, and how it follows from a drive."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from rumo.signals import Array
from rumo.studies.kpis.driven import Driven

SUFFIXES = {"1": "", "%": "percent", "m/s": "m_s", "m/s^2": "m_s2", "m/s^3": "m_s3", "1/s": "per_s"}
"""How units are written at the end of keys, where not as they are."""

Value = float | int | None | Mapping[str, Any]
"""None where log and driver do not say; a mapping where there is one for each wheel, input, constraint or status."""


@dataclass(frozen=True)
class Kpi:
    """A figure of merit.

    Attributes
    ----------
    name : str
        By which it is known: "lateral_deviation_rms".
    title : str
        For tables: "Lateral deviation, RMS".
    unit : str
        "1" for none.
    meaning : str
        A sentence.
    of : callable
        From a `Driven` to its value; None where it does not say.
    better : str
        Which values are better: "less", "more", or "" where neither are.
    """

    name: str
    title: str
    unit: str
    meaning: str
    of: Callable[[Driven], Value]
    better: str = "less"

    @property
    def key(self) -> str:
        """Name and unit, as in `summary.json`: "lateral_deviation_rms_m"."""
        suffix = SUFFIXES.get(self.unit, self.unit)
        return f"{self.name}_{suffix}" if suffix else self.name


def table(kpis: Iterable[Kpi]) -> dict[str, Kpi]:
    """Figures of merit by name."""
    return {kpi.name: kpi for kpi in kpis}


def rms(values: Array | None) -> float | None:
    """Root mean square of the finite ones."""
    values = _finite(values)
    return float(np.sqrt(np.mean(values**2))) if values.size else None


def largest(values: Array | None) -> float | None:
    """The largest magnitude."""
    values = _finite(values)
    return float(np.abs(values).max()) if values.size else None


def percentile(values: Array | None, share: float) -> float | None:
    """Percentile of the magnitudes."""
    values = _finite(values)
    return float(np.percentile(np.abs(values), share)) if values.size else None


def spread(name: str, title: str, unit: str, what: str, of: Callable[[Driven], Array | None]) -> list[Kpi]:
    """RMS, 95th percentile and largest magnitude of the same values (K,)."""
    return [
        Kpi(f"{name}_rms", f"{title}, RMS", unit, f"Root mean square of {what}.", lambda d: rms(of(d))),
        Kpi(
            f"{name}_p95",
            f"{title}, 95 %",
            unit,
            f"What 95 % of the sizes of {what} do not exceed.",
            lambda d: percentile(of(d), 95.0),
        ),
        Kpi(f"{name}_max", f"{title}, largest", unit, f"Largest size of {what}.", lambda d: largest(of(d))),
    ]


def _finite(values: Array | None) -> Array:
    return np.empty(0) if values is None else values[np.isfinite(values)]
