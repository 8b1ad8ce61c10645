"""A status says what is true: of limits that no input moves, and of limits far from zero."""

import numpy as np
import pytest
from problems import BACKENDS, made_with

import rumo
from rumo import Status

EVERY_BACKEND = [*BACKENDS, "ltv", "nlp"]


def controller_of(problem, backend):
    if backend == "ltv":
        return rumo.LinearTimeVarying(problem)
    return rumo.DirectNlp(problem) if backend == "nlp" else made_with(problem, backend)


def valve():
    """A valve beside its seat: with the flow at rest, no opening moves the pressure drop to first order."""
    return rumo.Model(
        states={"flow": "m^3/s"},
        inputs={"opening": "1"},
        dynamics=lambda x, u, p: {"flow": u.opening - x.flow},
    )


def beside_its_limit(limit, penalty=None):
    drop = rumo.Constraint(lambda x, u, p: 1.0 - x.flow**2, penalty, limit)
    return rumo.Problem(
        valve(),
        horizon=6,
        sampling_time=0.1,
        track={"flow": rumo.Weight(1.0)},
        moves={"opening": rumo.Weight(0.1)},
        bounds={"opening": (-1.0, 1.0)},
        constraints={"drop": drop},
    )


@pytest.mark.parametrize("backend", [*BACKENDS, "ltv"])
def test_a_hard_constraint_that_no_input_moves_is_no_solution(backend):
    """1 - flow^2 <= 0.5 about flow = 0: its gradient vanishes, so the linearised problem has no solution."""
    plan = controller_of(beside_its_limit(0.5), backend).step([0.0], {"flow": 0.0})
    assert plan.cause is Status.SOLVER_FAILED
    assert plan.conflict == tuple(f"drop at stage {k}" for k in range(1, 7))
    assert np.isfinite(plan.command.values).all()


@pytest.mark.parametrize("backend", [*BACKENDS, "ltv"])
@pytest.mark.parametrize(
    ("limit", "penalty", "status"),
    [(0.5, rumo.Penalty(1.0), Status.SOFT_VIOLATED), (1.0, None, Status.OPTIMAL), (1.5, None, Status.OPTIMAL)],
)
def test_one_that_is_soft_or_holds_is(backend, limit, penalty, status):
    plan = controller_of(beside_its_limit(limit, penalty), backend).step([0.0], {"flow": 0.0})
    assert plan.status is status
    assert plan.conflict == ()


def at_depth(lower, upper, penalty):
    """A boat whose position is measured from far away."""
    model = rumo.Model(
        states={"position": "m", "speed": "m/s"},
        inputs={"thrust": "N"},
        dynamics=lambda x, u, p: {"position": x.speed, "speed": u.thrust},
    )
    return rumo.Problem(
        model,
        horizon=10,
        sampling_time=0.1,
        track={"position": rumo.Weight(1.0, range=10.0)},
        moves={"thrust": rumo.Weight(0.1)},
        bounds={"thrust": (-1.0, 1.0), "position": rumo.Bounds(lower, upper, penalty)},
    )


@pytest.mark.parametrize("backend", EVERY_BACKEND)
def test_the_scale_of_bounds_is_their_width_however_far_they_are(backend):
    far = 5e6
    problem = at_depth(far, far + 3.5, rumo.Penalty(1.0))
    assert problem.constraint_scales.tolist() == [3.5, 3.5]
    wanted = {"position": far, "speed": 0.0}
    plan = controller_of(problem, backend).step([far + 5.0, 0.0], wanted)
    assert plan.status is Status.SOFT_VIOLATED
    assert plan.violations[0].amount == pytest.approx(1.5, abs=0.05)
    assert plan.violations[0].share == pytest.approx(1.5 / 3.5, abs=0.02)
    assert controller_of(problem, backend).step([far + 1.0, 0.0], wanted).status is Status.OPTIMAL


@pytest.mark.parametrize(
    ("lower", "upper", "scale"),
    [
        (300.0, 310.0, 10.0),
        (-310.0, -300.0, 10.0),
        (-2.0, 3.0, 5.0),
        (-np.inf, -4.0, 4.0),
        (2.0, np.inf, 2.0),
        (0.0, np.inf, 1.0),
        (7.0, 7.0, 7.0),
        (7.0, 7.0 + 1e-9, 7e-7),
        (0.0, 0.0, 1.0),
        (np.arange(10.0), np.arange(10.0) + 2.0, 2.0),  # a band that moves along the horizon
    ],
)
def test_scales_of_bounds(lower, upper, scale):
    problem = at_depth(lower, upper, None)
    np.testing.assert_allclose(problem.constraint_scales, scale, rtol=1e-9)


def test_a_hard_bound_that_is_exceeded_at_the_measurement_is_named():
    """Explicit Euler moves the position only after two intervals: before, no input does, and it is not imposed."""
    problem = at_depth(-1.0, 1.0, None)
    plan = rumo.RealTimeIteration(problem, rumo.ExplicitEuler()).step([3.0, 0.0], {"position": 0.0})
    assert plan.cause is Status.SOLVER_FAILED
    assert plan.conflict


@pytest.mark.parametrize("backend", [*BACKENDS, "ltv"])
def test_inputs_so_large_that_steps_are_lost_in_them_lead_to_no_solution(backend):
    """Two pumps against each other, without bounds: to 1e20 no step can be added, so no plan can come of it."""
    flows = rumo.Model(
        states={"level": "m"},
        inputs={"filling": "m/s", "drain": "m/s"},
        dynamics=lambda x, u, p: {"level": u.filling - u.drain},
    )
    problem = rumo.Problem(
        flows,
        horizon=5,
        sampling_time=0.1,
        track={"level": rumo.Weight(1.0)},
        moves={name: rumo.Weight(0.1) for name in flows.inputs},
    )
    controller = controller_of(problem, backend)
    controller.engage(applied=[1e20, 1e20], plan={"x": np.zeros((6, 1)), "u": np.full((5, 2), 1e20)})
    for level in (0.0, 0.2, 0.1):
        plan = controller.step([level], {"level": 1.0})
        moved = np.diff(plan.x.values[:, 0])
        if plan.status.solved:
            np.testing.assert_allclose(moved, 0.1 * (plan.u.values[:, 0] - plan.u.values[:, 1]), atol=1e-6)
        else:
            assert plan.cause is Status.ILL_CONDITIONED
    assert np.isfinite(plan.command.values).all()
