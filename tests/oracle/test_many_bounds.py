"""Horizons in which nearly all inputs are at bounds, and more rows hold than the core keeps factors of."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from problems import made_with

import rumo
from rumo.controllers.engines.described import core_problem, core_settings
from rumo.kernel import Core
from rumo.transcription import Transcription

HORIZON = 100


def carriage(horizon=HORIZON, **limits):
    """Weak in both directions, coupled, with some friction."""
    model = rumo.Model(
        {"x": "m", "y": "m", "v": "m/s", "w": "m/s"},
        {"push": "N", "pull": "N"},
        lambda x, u, p: {
            "x": x.v,
            "y": x.w,
            "v": u.push + 0.3 * u.pull - 0.1 * x.v,
            "w": u.pull - 0.2 * x.w - 0.1 * x.v,
        },
    )
    return rumo.Problem(
        model,
        horizon=horizon,
        sampling_time=0.05,
        delay=1,
        track={"x": rumo.Weight(1.0), "y": rumo.Weight(2.0)},
        moves={"push": rumo.Weight(1e-4, range=0.02), "pull": rumo.Weight(1e-4, range=0.02)},
        bounds={"push": (-0.01, 0.01), "pull": (-0.01, 0.01)},
        **limits,
    )


def targets(horizon=HORIZON):
    """Far off, then on the other side, then within reach."""
    steps = np.arange(horizon + 1)
    return [
        {"x": np.full(steps.size, 3.0), "y": np.full(steps.size, -3.0)},
        {"x": np.full(steps.size, -3.0), "y": np.full(steps.size, 3.0)},
        {"x": 0.02 * np.sin(0.1 * steps), "y": 0.02 * np.sign(np.sin(0.2 * steps))},
    ]


def test_the_inputs_are_at_bounds_indeed():
    controller = made_with(carriage(), "riccati")
    shares = [np.mean(np.abs(controller.step(np.zeros(4), wanted).u.values) > 0.01 - 1e-9) for wanted in targets()]
    assert min(shares[:2]) > 0.95
    assert 0.3 < shares[2] < 0.95


@pytest.mark.parametrize("limits", [{}, {"move_bounds": {"push": (-0.004, 0.004)}}], ids=["bounds", "moves"])
def test_limits_that_hold_to_the_end_of_the_horizon_are_taken_over(limits):
    controller = made_with(carriage(20, **limits), "riccati")
    plans = [controller.step(np.zeros(4), targets(20)[0]) for _ in range(6)]
    assert np.mean(np.abs(plans[-1].u.values) > 0.01 - 1e-9) == 1.0
    assert plans[0].iterations > 30
    assert [plan.iterations for plan in plans[1:]] == 5 * [0]


@pytest.mark.parametrize(
    "limits",
    [
        {},
        {"move_bounds": {"push": (-0.004, 0.004)}},
        {"constraints": {"fast": rumo.Constraint(lambda x, u, p: x.v - 0.004, rumo.Penalty(10.0, 1e3))}},
        {"constraints": {"fast": rumo.Constraint(lambda x, u, p: x.v - 0.01)}},
        {"blocks": rumo.InputBlocks([1] * 79 + [4] * 5)},
    ],
    ids=["bounds", "moves", "soft", "hard", "blocks"],
)
def test_plans_are_those_of_other_solvers(limits):
    problem = carriage(**limits)
    solvers = {backend: made_with(problem, backend) for backend in ("riccati", "condensing", "reference")}
    x = np.array([0.0, 0.0, 0.003, -0.003])
    for wanted in targets() * 2:
        plans = {name: solver.step(x, wanted) for name, solver in solvers.items()}
        for plan in plans.values():
            assert plan.status is plans["reference"].status
            np.testing.assert_allclose(plan.u.values, plans["reference"].u.values, atol=2e-8 * 0.02)
        assert plans["riccati"].diagnostics.kkt_residual < 1e-9
        x = plans["reference"].x.values[1]


def test_memory_is_linear_in_the_horizon():
    memory = [core(horizon).memory for horizon in (200, 400, 800)]
    assert memory[2] - memory[1] < 2.1 * (memory[1] - memory[0])


def core(horizon):
    values = core_problem(Transcription(carriage(horizon)), "riccati").values
    return Core(0, values, asdict(core_settings(rumo.Settings())))


def lag_below_a_limit(reach):
    """A lag that would go to 0.7 and may go to 0.1; inputs may be far larger than any that are wanted."""
    return rumo.Problem(
        rumo.Model(states={"x": "1"}, inputs={"u": "1"}, dynamics=lambda x, u, p: {"x": u.u - x.x}),
        horizon=20,
        sampling_time=0.1,
        track={"x": rumo.Weight(1.0)},
        moves={"u": rumo.Weight(1e-2 * reach**2, range=2.0 * reach)},
        bounds={"u": (-reach, reach), "x": (-0.1, 0.1)},
    )


@pytest.mark.parametrize("backend", ["riccati", "condensing"])
@pytest.mark.parametrize("reach", [1e3, 1e7, 1e11])
def test_a_hard_bound_holds_however_large_inputs_may_be(reach, backend):
    controller = made_with(lag_below_a_limit(reach), backend, gate=None)
    tolerance = rumo.QpOptions().tolerance  # not as fine as elsewhere in tests
    controller.configure(qp=replace(controller.settings.qp, tolerance=tolerance))
    oracle = rumo.DirectNlp(lag_below_a_limit(10.0), gate=None, tolerance=1e-11)
    plan, expected = (method.step([0.0], {"x": 0.7}) for method in (controller, oracle))
    assert plan.status is expected.status is rumo.Status.OPTIMAL
    np.testing.assert_allclose(plan.x.values, expected.x.values, atol=1e-6)
