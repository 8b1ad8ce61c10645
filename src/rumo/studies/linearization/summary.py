"""What became of the drives, in numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rumo.problem import Problem
from rumo.signals import Array
from rumo.simulation.log import signal
from rumo.status import Status
from rumo.studies.kpis import SETTLED, driving_kpis, heading_error, tracking_error
from rumo.studies.linearization.sweeps import SWEEPS

if TYPE_CHECKING:
    import xarray as xr

FAR = 10.0
"""A car that ends farther than this from its reference point is lost [m]."""
BACKWARDS = 0.5 * np.pi
"""So is one that has pointed farther than this away from its path [rad]."""

Logs = Mapping[str, Mapping[float, Mapping[str, "xr.Dataset"]]]
"""By sweep, value and controller."""


def sweep_outcomes(
    controllers: Sequence[str], problems: Mapping[str, Problem], duration: float, logs: Logs
) -> dict[str, Any]:
    """What became of each sweep, from the drives of some controllers that solved its problem for a duration [s].

    A value is left out where a controller has none.
    """
    sweeps: dict[str, Any] = {}
    for sweep, by_value in logs.items():
        problem = problems[sweep]
        steps = round(duration / problem.sampling_time)
        whole = {value: by_name for value, by_name in by_value.items() if len(by_name) == len(controllers)}
        if not whole:
            continue
        runs = {name: [outcome(logs[name], problem, steps) for logs in whole.values()] for name in controllers}
        for each in runs.values():
            for i, run in enumerate(each):
                run["cost_over_nlp"] = run["cost"] / runs["nlp"][i]["cost"] if "nlp" in runs else None
        about = {"title": SWEEPS[sweep].title, "unit": SWEEPS[sweep].unit, "horizon": problem.horizon}
        sweeps[sweep] = about | {"values": list(whole), "controllers": runs}
    return sweeps


def outcome(log: xr.Dataset, problem: Problem, steps: int) -> dict[str, Any]:
    """What became of a drive; None where it is too short to say.

    Parameters
    ----------
    log : Dataset
        Of the drive.
    problem : Problem
        That the controller solved.
    steps : int
        Number of samples of a whole drive.

    Returns
    -------
    dict
        Errors as in `driving_kpis`; `across_rms_after_2s_m`: their part across the path; `cost`: see
        `closed_loop_cost`; `unsolved_share`: share of steps without a solution; `violated_steps`: those whose plan
        violates a soft constraint, as the controller sees it; `untrusted_steps`: those that have not settled;
        `step_time_us`: median; `lost`: the car has pointed backwards, or has ended far from its reference point, or the
        plant could not be integrated to the end.
    """
    kpis, error = driving_kpis(log), tracking_error(log)
    turned = np.abs(heading_error(log))
    across = _across(log)[log["time"].to_numpy() >= SETTLED]
    statuses = [Status[str(status)] for status in log["status"].to_numpy()]
    return {
        "tracking_error_rms_m": kpis["tracking_error_rms_m"],
        "tracking_error_rms_after_2s_m": kpis["tracking_error_rms_after_2s_m"],
        "across_rms_after_2s_m": float(np.sqrt(np.mean(across**2))) if across.size else None,
        "tracking_error_max_m": float(error.max()),
        "cost": closed_loop_cost(log, problem),
        "unsolved_share": sum(not status.solved for status in statuses) / len(statuses),
        "violated_steps": statuses.count(Status.SOFT_VIOLATED),
        "untrusted_steps": statuses.count(Status.UNTRUSTED),
        "step_time_us": kpis["step_time_us"]["p50"],
        "lost": bool(turned.max() > BACKWARDS or error[-1] > FAR or len(error) < steps),
    }


def closed_loop_cost(log: xr.Dataset, problem: Problem) -> float:
    """The problem's objective along the trajectory that was driven.

    Squared errors of the tracked outputs at each sample but the first, and squared increments of the inputs that were
    applied, with the weights of stage 1. Headings are not wrapped: a car that has turned once around pays for it.
    The price of soft constraints is left out; the plant's tyres have no friction circle to violate.
    """
    errors = np.column_stack([signal(log, "plant", name) - signal(log, "reference", name) for name in problem.outputs])
    moves = np.diff(log["applied"].to_numpy(), axis=0)
    return float((errors[1:] ** 2 @ problem.output_weights[0]).sum() + (moves**2 @ problem.move_weights[0]).sum())


def _across(log: xr.Dataset) -> Array:
    """Distance of the plant from the reference's tangent at each sample (K,) [m]."""
    psi = signal(log, "reference", "psi")
    dx, dy = (signal(log, "plant", name) - signal(log, "reference", name) for name in ("p_x", "p_y"))
    return dy * np.cos(psi) - dx * np.sin(psi)


def at_values(sweep: Mapping[str, Any], which: Sequence[int]) -> str:
    """Some values of a sweep in words, "at 4, 5 m", or nothing."""
    values = ", ".join(f"{sweep['values'][i]:g}" for i in which)
    return f"at {values} {sweep['unit']}".removesuffix(" 1") if which else ""


def lost_at(runs: Sequence[Mapping[str, Any]]) -> list[int]:
    """Which drives of a controller are lost."""
    return [i for i, run in enumerate(runs) if run["lost"]]


def cost_ratios(sweep: Mapping[str, Any], name: str) -> Array:
    """Cost over the NLP's, NaN where either is lost or the NLP is not solved in every step."""
    runs, nlp = sweep["controllers"].get(name, []), sweep["controllers"].get("nlp", [])
    return np.array(
        [
            np.nan if run["lost"] or best["lost"] or best["unsolved_share"] else run["cost_over_nlp"]
            for run, best in zip(runs, nlp, strict=False)
        ]
    )


def quantity(sweep: Mapping[str, Any]) -> str:
    """What grows, with its unit."""
    return f"{sweep['title']} [{sweep['unit']}]"
