"""The core's guard decides what the policy of the controllers in Python does, whatever a solver comes to."""

from functools import partial

import numpy as np
import pytest
from problems import pendulum, tank

import rumo
from rumo.controllers.fallback import Trajectory as PolicyTrajectory
from rumo.controllers.policy import UNKNOWN, Candidate, PolicyController
from rumo.kernel import Guard, Settings, Trajectory
from rumo.status import Status

PERIOD = 0.05
STEPS = 250


class Scripted(PolicyController):
    """A controller whose solver comes to what it is told."""

    script = None

    def _prepare(self, guess):
        return self.script.prepares

    def _reach(self):
        return None if self.script is None else self.script.reach

    def _solve(self, x, window, guess):
        told = self.script
        if told.candidate is None:
            return None
        constraints = np.zeros((self.problem.horizon, len(self.problem.constraints)))
        return Candidate(PolicyTrajectory(*told.candidate), constraints, told.status, UNKNOWN)


class Script:
    """What happens at one sample."""

    def __init__(self, rng, shapes):
        self.prepares = rng.random() > 0.05
        self.reach = None if rng.random() < 0.02 else rng.choice([0.0, 0.1, 1.0], size=shapes[1][1], p=[0.1, 0.5, 0.4])
        self.candidate = None
        self.status = Status.OPTIMAL
        if rng.random() < 0.75:
            self.status = rng.choice(
                [Status.OPTIMAL, Status.SOFT_VIOLATED, Status.BUDGET_EXCEEDED, Status.SOLVER_FAILED]
            )
            parts = [rng.normal(size=shape) for shape in shapes]
            if rng.random() < 0.1:
                spoilt = parts[rng.integers(2)]
                spoilt.flat[rng.integers(spoilt.size)] = rng.choice([np.nan, np.inf])
            self.candidate = Trajectory(*parts)


def step(guard, x, wanted, script):
    """The order of things in a controller, see `PolicyController`."""
    if not guard.has_guess and np.isfinite(x).all():
        guard.rest()
    if guard.has_guess and not script.prepares:
        guard.drop()
    status = guard.admit(x, wanted, script.reach)
    candidate = None
    if status is Status.OPTIMAL:
        if not guard.has_guess:
            guard.rest()
            status = status if script.prepares else Status.SOLVER_FAILED
        if status is Status.OPTIMAL:
            candidate = script.candidate
            status = Status.SOLVER_FAILED if candidate is None else script.status
    return guard.follow(candidate, status)


def guard_of(controller, gate):
    problem, shift, transcription = controller.problem, controller._shift, controller.transcription
    sizes = {
        "horizon": problem.horizon,
        "states": len(problem.model.states),
        "algebraic": len(problem.model.algebraic),
        "inputs": len(problem.model.inputs),
        "delay": problem.delay,
    }
    values = {f"shift_{name}": getattr(shift, name) for name in ("stages", "shares", "intervals")}
    values |= {"inner_signals": transcription.inner_signals, "inner_nodes": transcription.inner_nodes}
    names = ("input_lower", "input_upper", "move_lower", "move_upper", "safe_input")
    values |= {name: getattr(problem, name) for name in names}
    return Guard(sizes, values, Settings(gate_width=gate.width, gate_patience=gate.patience))


MOVES = {"move_bounds": {"torque": (-0.5, 0.4)}}
CASES = {
    "plain": (pendulum(), rumo.ImplicitEuler()),
    "moves": (pendulum(**MOVES), rumo.ImplicitEuler()),
    "no delay": (pendulum(delay=0, **MOVES), rumo.Radau2()),
    "long delay": (pendulum(delay=3, **MOVES), rumo.Bdf2(substeps=3)),
    "growing": (pendulum(horizon=rumo.Grid.geometric(10, PERIOD, 1.3, equal=3), **MOVES), rumo.Radau3()),
    "one interval": (pendulum(delay=0, horizon=1), rumo.ImplicitEuler()),
    "explicit": (tank(), rumo.Rk4(substeps=2)),
}


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("case", CASES)
def test_the_same_sequence_of_samples(case, seed):
    rng = np.random.default_rng(seed)
    problem, scheme = CASES[case]
    gate = rumo.InnovationGate(width=rng.uniform(0.5, 3.0), patience=int(rng.integers(4)))
    controller = Scripted(problem, scheme, gate=gate)
    guard = guard_of(controller, gate)
    nx, nu = len(problem.model.states), len(problem.model.inputs)
    shapes = (
        (problem.horizon, nu),
        (problem.horizon + 1, nx),
        (problem.horizon, len(controller.transcription.inner_signals)),
    )
    wanted = np.zeros((problem.horizon + 1, len(problem.outputs)))
    # To the last bit where nothing lies between two stages; there, multiplications and additions may fuse.
    exact = case in ("plain", "moves", "one interval")
    same = np.testing.assert_array_equal if exact else partial(np.testing.assert_allclose, rtol=1e-12, atol=1e-12)
    x = np.zeros(nx)
    for k in range(STEPS):
        told = controller.script = Script(rng, shapes)
        if rng.random() < 0.7:
            x = x if rng.random() < 0.4 else rng.normal(scale=0.3, size=nx)
        elif rng.random() < 0.7:
            x = rng.choice([1.0, 20.0, np.nan]) * rng.normal(size=nx)
        wanted[0, 0] = np.nan if rng.random() < 0.05 else 0.0
        if rng.random() < 0.1:
            controller.applied = guard.applied = rng.normal(size=controller.applied.shape)
        plan = controller.step(x, wanted)
        assert step(guard, x, wanted, told) == (plan.status, plan.cause), f"sample {k}"
        same(guard.plan.u, plan.u.values)
        same(guard.plan.x, plan.x.values)
        same(guard.applied, controller.applied)
        assert guard.has_guess == (controller._guess is not None)
        assert (guard.next is None) == (controller._previous is None)
        if guard.next is not None:
            for ours, theirs in zip(guard.next, vars(controller._previous).values(), strict=True):
                same(ours, theirs)
        if k % 100 == 99:
            controller.reset()
            guard.reset()
    assert guard.counts == controller.status_counts
    assert len(guard.counts) > (2 if case == "one interval" else 5)
