"""A soft bound with l1 = 1 is kept wherever it can be kept, whatever its unit and the horizon."""

import casadi as ca
import numpy as np
import pytest
from problems import BACKENDS, made_with, pendulum
from scipy.optimize import linprog

import rumo

GRAVITY, ROPE = 9.81, 5.0


def crane(penalty, horizon, sway=1.0):
    """A trolley with a hanging load; `sway` is the size of the unit of its angle, in parts of a radian."""
    model = rumo.Model(
        states={"position": "m", "speed": "m/s", "sway": "1", "sway_rate": "1/s"},
        inputs={"acceleration": "m/s^2"},
        dynamics=lambda x, u, p: {
            "position": x.speed,
            "speed": u.acceleration,
            "sway": x.sway_rate,
            "sway_rate": sway * -(GRAVITY * ca.sin(x.sway / sway) + u.acceleration * ca.cos(x.sway / sway)) / ROPE,
        },
    )
    return rumo.Problem(
        model,
        horizon=horizon,
        sampling_time=0.1,
        track={"position": rumo.Weight(1.0, range=10.0)},
        moves={"acceleration": rumo.Weight(0.01, range=2.0)},
        bounds={"acceleration": (-1.0, 1.0), "sway": rumo.Bounds(-0.05 * sway, 0.05 * sway, penalty)},
    )


@pytest.mark.parametrize("horizon", [15, 30, 60])
@pytest.mark.parametrize("sway", [1.0, 1e-4, 1e4])
def test_it_is_the_hard_bound_where_that_can_be_met(horizon, sway):
    soft, hard = (rumo.RealTimeIteration(crane(penalty, horizon, sway)) for penalty in (rumo.Penalty(1.0), None))
    x, at_limit = np.zeros(4), 0
    for _ in range(30):
        plan, expected = (controller.step(x, {"position": 10.0}) for controller in (soft, hard))
        assert plan.status is expected.status is rumo.Status.OPTIMAL
        np.testing.assert_allclose(plan.u.values, expected.u.values, atol=1e-7)
        at_limit += bool((np.abs(plan.constraints.values) < 1e-9 * sway).any())
        x = expected.x.values[1]
    assert at_limit == 30


def test_a_price_a_thousand_times_lower_does_not_keep_it():
    plan = rumo.RealTimeIteration(crane(rumo.Penalty(0.001), 30)).step(np.zeros(4), {"position": 10.0})
    assert plan.status is rumo.Status.SOFT_VIOLATED


def side_by_side(names, price, horizon):
    """Lags that share nothing, each with an input; `a`, if it is among them, is to stay within 0.3 at any price."""
    rates = {"a": 0.5, "b": 0.2}
    return rumo.Problem(
        rumo.Model(
            states=dict.fromkeys(names, "1"),
            inputs={f"push_{name}": "1" for name in names},
            dynamics=lambda x, u, p: {name: u[f"push_{name}"] - rates[name] * x[name] for name in names},
        ),
        horizon=horizon,
        sampling_time=0.1,
        track={name: rumo.Weight(1.0) for name in names},
        moves={f"push_{name}": rumo.Weight(0.1, range=2.0) for name in names},
        bounds={f"push_{name}": (-1.0, 1.0) for name in names}
        | ({"a": rumo.Bounds(-0.3, 0.3, rumo.Penalty(price))} if "a" in names else {}),
    )


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(
    ("price", "horizon", "samples"),
    [
        (1e13, 2, [((-0.7, 0.9), (0.0, -0.5)), ((0.8, 0.6), (0.6, 0.8))]),
        (1e12, 5, [((-0.8, 0.7), (0.8, -0.9)), ((0.6, -0.5), (-0.3, -0.7))]),
        (1e11, 3, [((0.8, 0.1), (-0.4, -0.7)), ((-0.8, 0.8), (0.3, 0.6))]),
    ],
)
def test_a_price_beyond_all_measure_does_not_reach_what_is_beside_it(price, horizon, samples, backend):
    """The second of two samples, so that a solver starts from the first; without `a`, `b` has the same plan."""
    both, alone = (made_with(side_by_side(names, price, horizon), backend, gate=None) for names in ("ab", "b"))
    for x, wanted in samples:
        plan = both.step(x, dict(zip("ab", wanted, strict=True)))
        expected = alone.step([x[1]], {"b": wanted[1]})
        assert plan.status.solved or plan.status is rumo.Status.ILL_CONDITIONED
        if plan.status.solved:
            np.testing.assert_allclose(plan.u["push_b"], expected.u["push_b"], atol=1e-6)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(("gain", "start", "wanted", "before"), [(1.0, -1.4, -0.9, -0.1), (-1.0, 1.9, 0.8, 0.7)])
def test_no_input_is_at_two_bounds(gain, start, wanted, before, backend):
    """Beside a price of 1e12 rounding hides the forces that keep some inputs at a bound; 1e3 has the same plan."""

    def lag(price):
        return rumo.Problem(
            rumo.Model(states={"x": "1"}, inputs={"u": "1"}, dynamics=lambda x, u, p: {"x": gain * u.u - 6.0 * x.x}),
            horizon=5,
            sampling_time=0.1,
            track={"x": rumo.Weight(1.0)},
            moves={"u": rumo.Weight(0.01, range=2.0)},
            bounds={"u": (-1.0, 1.0), "x": rumo.Bounds(-0.3, 0.2, rumo.Penalty(price))},
        )

    controllers = [
        made_with(lag(1e12), backend, rumo.ExplicitEuler(), gate=None),
        rumo.DirectNlp(lag(1e3), rumo.ExplicitEuler(), gate=None, tolerance=1e-11),
    ]
    for controller in controllers:
        controller.reset(applied=[before])
    plan, oracle = (controller.step([start], {"x": wanted}) for controller in controllers)
    assert plan.status is oracle.status is rumo.Status.SOFT_VIOLATED
    np.testing.assert_allclose(plan.u.values, oracle.u.values, atol=1e-6)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("l2", [1e8, 1e9])
def test_a_steep_bound_out_of_reach_is_solved(l2, backend):
    """The pendulum turns faster than its torque can stop: that sits at its bound, and forces of 1e9 balance."""
    problem = pendulum(bounds={"torque": (-2.0, 2.0), "rate": rumo.Bounds(-0.5, 0.5, rumo.Penalty(1.0, l2))})
    controllers = [
        made_with(problem, backend, gate=None),
        rumo.DirectNlp(problem, gate=None, tolerance=1e-10),
    ]
    rng = np.random.default_rng(0)
    for x in rng.uniform([-1.0, -3.0], [1.0, 3.0], (12, 2)):
        plan, oracle = (controller.step(x, {"angle": 0.0}) for controller in controllers)
        assert plan.status is oracle.status
        assert plan.command["torque"] == pytest.approx(oracle.command["torque"], abs=1e-6)
        for controller in controllers:
            controller.reset()


@pytest.mark.parametrize("backend", BACKENDS)
def test_rows_give_way_only_beyond_their_limits(backend):
    """Rounding swallows a price of the second kind beside so high a one of the first, and with it where a row is."""
    F, G = np.array([[4.79, 0.46, -0.06], [0.24, 4.51, -0.16], [-0.06, 0.21, 4.43]]), np.array([-0.65, -0.96, 0.8])
    names, price = ["a", "b", "c"], rumo.Penalty(314.0, 1.65e-15)
    limits = {"a": (-0.21, 0.45), "b": (-0.26, 0.27), "c": (-0.38, 0.23)}
    problem = rumo.Problem(
        rumo.Model(
            states=dict.fromkeys(names, "1"),
            inputs={"u": "1"},
            dynamics=lambda x, u, p: {
                name: sum(F[i, j] * x[other] for j, other in enumerate(names)) + G[i] * u.u
                for i, name in enumerate(names)
            },
        ),
        horizon=10,
        sampling_time=0.1,
        track=dict.fromkeys(names, rumo.Weight(1e-8)),
        moves={"u": rumo.Weight(1e-10, range=2.0)},
        bounds={"u": (-1.0, 1.0)} | {name: rumo.Bounds(*limit, price) for name, limit in limits.items()},
    )
    x, wanted = np.array([-0.61, 0.25, -0.48]), {"a": -1.16, "b": 2.03, "c": -0.74}
    controller = made_with(problem, backend, rumo.Gauss2(), gate=None)
    controller.reset(applied=[-0.18])
    plan = controller.step(x, wanted)
    assert plan.status is rumo.Status.SOFT_VIOLATED

    # The price of violations alone, as a linear program in u and slacks.
    transcription, response, start = controller.transcription, [], [x]
    for _ in range(10):
        start.append(transcription.advance(start[-1], [0.0])[0][:3])
    for k in range(10):
        ends = [np.zeros(3)]
        for i in range(10):
            ends.append(transcription.advance(ends[-1], [float(i == k)])[0][:3])
        response.append(np.array(ends)[1:].ravel())
    low, high = (np.tile([limits[name][i] for name in names], 10) for i in (0, 1))
    free, effect = np.array(start)[1:].ravel(), np.array(response).T
    rows = np.block([[effect, -np.eye(30)], [-effect, -np.eye(30)]])
    bounds = [(-1.0, 1.0)] * 10 + [(0.0, None)] * 30
    best = linprog(np.r_[np.zeros(10), np.ones(30)], rows, np.r_[high - free, free - low], bounds=bounds)
    np.testing.assert_allclose(plan.u.values.ravel(), best.x[:10], atol=1e-6)
