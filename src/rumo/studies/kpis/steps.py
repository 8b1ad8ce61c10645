"""What the steps of controller and estimator came to: times, deadlines, statuses, fallbacks, innovations."""

from __future__ import annotations

from collections import Counter

import numpy as np

from rumo.simulation.variables import SKIPPED
from rumo.status import Status
from rumo.studies.kpis.base import Kpi, table
from rumo.studies.kpis.driven import Driven

APPLIED = (SKIPPED, *(status.name for status in Status if status.applicable))
"""Statuses of steps at which nothing had to stand in for a plan."""


def _statuses(drive: Driven) -> list[str]:
    return [str(status) for status in drive.log["status"].to_numpy()]


def _step_time(drive: Driven) -> dict[str, float] | None:
    times = 1e6 * drive.log["step_time"].to_numpy()
    times = times[np.isfinite(times)]
    if not times.size:
        return None
    percentiles = {f"p{share:g}": float(np.percentile(times, share)) for share in (50, 99, 99.9)}
    return {"mean": float(times.mean()), **percentiles, "max": float(times.max())}


def _misses(drive: Driven) -> int:
    return int((drive.log["waited_time"].to_numpy() > drive.sampling_time).sum())


def _nis(drive: Driven) -> float | None:
    nis = drive.log["nis"].to_numpy()
    return float(np.nanmean(nis)) if np.isfinite(nis).any() else None


def _expected(drive: Driven) -> float | None:
    used = np.nansum(drive.log["innovation_used"].to_numpy(), axis=1)
    return float(used[used > 0.0].mean()) if (used > 0.0).any() else None


STEPS = table(
    [
        Kpi("step_time", "Step time", "us", "Computation of a step: mean, percentiles and largest.", _step_time),
        Kpi(
            "deadline_misses",
            "Deadline misses",
            "1",
            "Steps for which the loop had to wait longer than a sampling time.",
            _misses,
        ),
        Kpi("status_counts", "Steps", "1", "Number of steps by status.", lambda d: dict(Counter(_statuses(d))), ""),
        Kpi(
            "fallbacks",
            "Fallbacks",
            "1",
            "Steps at which the plan before, or the safe input, stood in for a plan.",
            lambda d: sum(status not in APPLIED for status in _statuses(d)),
        ),
        Kpi(
            "rescued",
            "Rescued steps",
            "1",
            "Steps at which the nonlinear program's solution was the plan.",
            lambda d: int(np.nansum(d.log["rescued"].to_numpy())),
            "",
        ),
        Kpi(
            "nis",
            "NIS, mean",
            "1",
            "Normalised innovation squared; of a filter that is right, as large as the number of measurements.",
            _nis,
            "",
        ),
        Kpi("nis_expected", "NIS expected", "1", "Mean number of measurements used in a sample.", _expected, ""),
    ]
)
"""Of controller and estimator."""
