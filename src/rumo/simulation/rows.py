"""What a log says of a sample: from parts of it to a row, and from rows to columns."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice
from typing import Any

import numpy as np

from rumo.checks import checked
from rumo.errors import ShapeError
from rumo.estimation import Innovation
from rumo.plan import Plan, PlanLayout
from rumo.problem import Problem
from rumo.signals import Array, Signals
from rumo.simulation.variables import SKIPPED, TIMES

LOGGED = 3
"""Parts of a plan that a log has: inputs, states, constraints."""
Row = dict[str, Any]
"""What is known of a sample, by the variables of a log, in arrays that nobody changes. A `plan` is its
numbers, see `PlanLayout`; what is `sensed`, and what has `arrived` of it, is in the order of the sensors."""


def of_plan(plan: Plan | None) -> Row:
    """Of a plan, or of a sample at which the controller did not run."""
    if plan is None:
        return {"status": SKIPPED, "cause": SKIPPED, "rescued": False, **dict.fromkeys(TIMES, np.nan)}
    timings = plan.timings
    return {
        "plan": plan.packed()[: plan.layout.parts[LOGGED].start],
        "status": plan.status.name,
        "cause": plan.cause.name,
        "rescued": plan.rescued,
        "prepare_time": timings.prepare,
        "feedback_time": timings.feedback,
        "step_time": timings.total,
        "waited_time": timings.waited,
        **of_health(plan),
    }


def check_parts(plan: Plan, problem: Problem) -> None:
    """Raise unless a plan has the parts of plans of a problem."""
    found, expected = plan.layout.shapes, PlanLayout(problem).shapes
    for name, part in (("predicted_states", 1), ("predicted_inputs", 0), ("slacks", 2)):
        if found[part] != expected[part]:
            raise ShapeError(name, f"shape {found[part]}", f"shape {expected[part]}")


def of_health(plan: Plan) -> Row:
    """Sizes of the symptoms of readings (nx,), 0 where there is none, and what they are, if there are any."""
    symptoms, states = plan.health, plan.problem.model.states
    sizes = np.zeros(len(states))
    if not symptoms:
        return {"health": sizes}
    kinds = [""] * len(states)
    for symptom in symptoms:
        i = states.index(symptom.state)
        sizes[i], kinds[i] = symptom.size, symptom.kind
    return {"health": sizes, "symptom": kinds}


def of_innovation(innovation: object) -> Row:
    """Of an innovation, where there is one."""
    if innovation is None:
        return {}
    known = checked(innovation, "innovation", Innovation)
    parts = {"innovation": known.values, "innovation_deviation": known.deviations, "innovation_used": known.used}
    return parts | {"nis": known.nis}


def columns_of_plans(rows: Sequence[Row], problem: Problem) -> dict[str, Array]:
    """Commands, predictions and constraints (K, ...) of the plans in rows."""
    layout = PlanLayout(problem)
    plans, parts = column(rows, "plan", (layout.parts[LOGGED].start,)), zip(layout.parts, layout.shapes, strict=True)
    u, x, constraints = (plans[:, part].reshape(len(rows), *shape) for part, shape in islice(parts, LOGGED))
    return {
        "commanded": u[:, problem.delay],
        "predicted_states": x,
        "predicted_inputs": u,
        "constraints": constraints,
        "slacks": np.maximum(constraints, 0.0),
    }


def columns_of_readings(rows: Sequence[Row], measured: Signals, states: Signals) -> dict[str, Array]:
    """What was measured and what was received of it: states (K, nx), NaN where they are not measured, and others."""
    columns: dict[str, Array] = {}
    known = [(i, measured.index(name)) for i, name in enumerate(states) if name in measured]
    others = [j for j, name in enumerate(measured) if name not in states]
    for name, key in (("measured", "sensed"), ("received", "arrived")):
        readings = column(rows, key, (len(measured),))
        columns[name] = of_states = np.full((len(rows), len(states)), np.nan)
        of_states[:, [i for i, _ in known]] = readings[:, [j for _, j in known]]
        columns[f"{name}_outputs"] = readings[:, others]
    return columns


def column(rows: Sequence[Row], name: str, shape: tuple[int, ...] = (), kind: type = float) -> Array:
    """A variable of rows (K, *shape); NaN, an empty text or False where they have none."""
    nothing = np.full(shape, np.nan if kind is float else kind())
    if not any(name in row for row in rows):
        return np.tile(nothing, (len(rows), *[1] * len(shape)))
    return np.array([row.get(name, nothing) for row in rows], dtype=kind).reshape(len(rows), *shape)
