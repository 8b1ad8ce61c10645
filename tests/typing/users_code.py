"""What a user may write, for the type checker; it runs as well."""

from collections.abc import Mapping
from typing import assert_type

import casadi as ca
import numpy as np

import rumo
from rumo.controllers.engines.base import Candidate, Method
from rumo.controllers.engines.guarded import Guarded
from rumo.controllers.engines.trajectory import Trajectory
from rumo.signals import Array
from rumo.transcription import Transcription

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
assert_type(controller.settings, rumo.Settings)
assert_type(rumo.DirectNlp(other).settings, rumo.NlpSettings)
controller.configure(sqp_iterations=3, gate=None)
controller.update(weights={"angle": 20.0}, bounds={"f": (-2.0, 2.0)})
controller.engage(applied={"f": 0.0}, plan=plan)


class Counting(rumo.RealTimeIteration):
    """A subclass with an attribute of its own."""

    def __init__(self, problem: rumo.Problem) -> None:
        super().__init__(problem, sqp_iterations=2)
        self.laps = 0


class Hold(Method):
    """Proposes what was decided last."""

    def __init__(self, problem: rumo.Problem) -> None:
        self.transcription = Transcription(problem)

    def solve(self, x: Array, window: Mapping[str, Array], guess: Trajectory, applied: Array) -> Candidate | None:
        problem = self.transcription.problem
        held = Trajectory(np.tile(applied[-1], (problem.horizon, 1)), guess.x, guess.inner)
        return Candidate(held, np.zeros((problem.horizon, len(problem.constraints))), rumo.Status.OPTIMAL)


class Holding(rumo.Controller):
    """A controller of one's own."""

    name = "hold"

    def __init__(self, problem: rumo.Problem) -> None:
        method, settings = Hold(problem), rumo.ControllerSettings()
        super().__init__(method.transcription, Guarded(method, settings), settings)


assert_type(Counting(other).step([0.0, 0.0], {"angle": 1.0}), rumo.Plan)
assert_type(Holding(other).step([0.0, 0.0], {"angle": 1.0}).command["f"], float)
