"""What a user may write, for the type checker; nothing runs it."""

from typing import assert_type

import casadi as ca
import numpy as np

import rumo
from rumo.signals import Array

pendulum = rumo.Model(
    states={"angle": "rad", "rate": "rad/s"},
    inputs={"f": "N m"},
    dynamics=lambda x, u, p: {"angle": x.rate, "rate": u.f - p["gravity"] * ca.sin(x.angle)},
    parameters={"gravity": rumo.Parameter("m/s^2", 9.81)},
)
problem = rumo.Problem(
    pendulum,
    horizon=rumo.Grid.geometric(10, 0.05, 1.2, equal=2),
    sampling_time=0.05,
    delay=1,
    track={"angle": rumo.Weight(np.ones(10), range=3.0)},
    moves={"f": rumo.Weight(0.1)},
    bounds={"f": (-1, 1.0), "rate": rumo.Bounds(-1.0, np.linspace(1.0, 2.0, 10), rumo.Penalty(1.0))},
    move_bounds={"f": [-0.5, 0.5]},
    constraints={"power": rumo.Constraint(lambda x, u, p: u.f * x.rate, rumo.Penalty(1.0), limit=2.0)},
)
other = problem.changed(
    weights={"angle": 2.0},
    ranges={"f": 2.0},
    bounds={"f": (-np.ones(10), 1.0)},
    limits={"power": [1.0] * 10},
    penalties={"power": None},
    parameters={"gravity": 9.8},
)
assert_type(other, rumo.Problem)

controller = rumo.RealTimeIteration(other)
plan = controller.step([0.0, 0.0], {"angle": 1.0})
assert_type(plan.command["f"], float)
assert_type(plan.command.as_dict(), dict[str, float])
assert_type(plan.x["angle"], Array)
assert_type(plan.status, rumo.Status)
assert_type(plan.diagnostics.integrated, bool)
torque: float = round(plan.command["f"], 3)
