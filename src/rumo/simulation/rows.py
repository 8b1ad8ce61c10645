"""What a log says of a sample's plan and innovation."""

from __future__ import annotations

from typing import Any

import numpy as np

from rumo.checks import checked
from rumo.estimation import Innovation
from rumo.plan import Plan
from rumo.signals import Signals
from rumo.simulation.variables import SKIPPED, TIMES


def of_plan(plan: Plan | None) -> dict[str, Any]:
    """Of a plan, or of a sample at which the controller did not run."""
    if plan is None:
        return {"status": SKIPPED, "cause": SKIPPED, "rescued": False, **dict.fromkeys(TIMES, np.nan)}
    return {
        "commanded": plan.command.values,
        "predicted_states": plan.x.values,
        "predicted_inputs": plan.u.values,
        "constraints": plan.constraints.values,
        "slacks": plan.slacks.values,
        "status": plan.status.name,
        "cause": plan.cause.name,
        "rescued": plan.rescued,
        "prepare_time": plan.timings.prepare,
        "feedback_time": plan.timings.feedback,
        "step_time": plan.timings.total,
        "waited_time": plan.timings.waited,
    }


def of_health(plan: Plan | None, states: Signals) -> dict[str, Any]:
    """Sizes of the symptoms of readings (nx,), 0 where there is none, and what they are (nx,)."""
    sizes, kinds = np.full(len(states), np.nan if plan is None else 0.0), [""] * len(states)
    for symptom in plan.health if plan else ():
        i = states.index(symptom.state)
        sizes[i], kinds[i] = symptom.size, symptom.kind
    return {"health": sizes, "symptom": kinds}


def of_innovation(innovation: object) -> dict[str, Any]:
    """Of an innovation, where there is one."""
    if innovation is None:
        return {}
    known = checked(innovation, "innovation", Innovation)
    parts = {"innovation": known.values, "innovation_deviation": known.deviations, "innovation_used": known.used}
    return parts | {"nis": known.nis}
