"""Models with actuators before their inputs, held to transfer functions and to the equations written by hand."""

import pickle

import casadi as ca
import numpy as np
import pytest

import rumo
from rumo.actuation import behind_actuators
from rumo.textbook import cart_pendulum
from rumo.vehicles import PASSENGER_CAR, path_problem, rolling_bicycle


def integrators():
    """Two states that are integrals of two inputs, and an output that sees an input."""
    return rumo.Model(
        states={"a": "m", "b": "m"},
        inputs={"fast": "m/s", "slow": "m/s"},
        dynamics=lambda x, u, p: {"a": u.fast, "b": p.gain * u.slow},
        parameters={"gain": rumo.Parameter("1", 2.0)},
        outputs={"seen": rumo.Output("m/s", lambda x, u, p: u.slow)},
    )


def response(model, frequency):
    """Of the rates of a and b, to the commands, at a frequency (2, 2)."""
    n = len(model.states)
    arguments = [model.xz, model.u, model.p]
    f = model.f(*arguments)
    matrices = ca.Function("m", arguments, [ca.jacobian(f, model.x), ca.jacobian(f, model.u)])
    A, B = (m.full() for m in matrices(np.zeros(n), np.zeros(2), model.default_parameters))
    return 1j * frequency * np.linalg.solve(1j * frequency * np.eye(n) - A, B)[:2]


@pytest.mark.parametrize("dead_time", [0.0, 0.03, 0.1])
@pytest.mark.parametrize("lag", [0.0, 0.05])
@pytest.mark.parametrize("shared", [0.0, 0.2])
def test_frequency_responses_are_those_of_the_actuators(dead_time, lag, shared):
    """The error of the approximation is (sT)^4 / 72 and less, which is its first term."""
    actuation = rumo.Actuation(
        {"fast": rumo.Actuator(dead_time=shared), "slow": rumo.Actuator(lag, dead_time=shared + dead_time)}
    )
    model = rumo.with_actuators(integrators(), actuation)
    for frequency in (0.1, 1.0, 5.0, 10.0):
        s = 1j * frequency
        exact = 2.0 * np.exp(-s * dead_time) / (1.0 + s * lag)
        G = response(model, frequency)
        np.testing.assert_allclose(G[0], [1.0, 0.0], atol=1e-12)
        assert abs(G[1, 1] - exact) <= 2.0 * (frequency * dead_time) ** 4 / 72.0 + 1e-12


def test_a_step_is_not_answered_at_once():
    slow = rumo.Actuation({"slow": rumo.Actuator(dead_time=0.1)})
    assert abs(response(rumo.with_actuators(integrators(), slow), 1e6)[1, 1]) < 1e-3


def test_outputs_see_what_the_actuators_do():
    model = rumo.with_actuators(integrators(), rumo.Actuation({"slow": rumo.Actuator(lag=0.1)}))
    seen = ca.Function("seen", [model.x, model.u], [model.expression("seen", "test")])
    assert float(seen([0.0, 0.0, 0.7], [0.1, 0.2])) == pytest.approx(0.7)
    assert model.states.unit("slow_lag") == "m/s"


def test_a_dead_time_that_all_share_needs_no_states():
    model = integrators()
    late = rumo.Actuator(dead_time=0.1, rate=2.0)
    assert rumo.with_actuators(model, rumo.Actuation({"fast": late, "slow": late}, computation=0.2)) is model
    assert rumo.with_actuators(model, rumo.Actuation()) is model


def test_a_lag_is_the_one_written_by_hand():
    lag = rumo.Actuation({"force": rumo.Actuator(lag=0.08)})
    made, cart = rumo.with_actuators(cart_pendulum(), lag), cart_pendulum()
    rng = np.random.default_rng(0)
    x, u = rng.normal(size=5), rng.normal(size=1)
    p = cart.default_parameters
    rates = made.f(x, u, p).full().ravel()
    np.testing.assert_allclose(rates[:4], cart.f(x[:4], x[4:], p).full().ravel())
    assert rates[4] == pytest.approx((u[0] - x[4]) / 0.08)
    again = pickle.loads(pickle.dumps(made))
    np.testing.assert_array_equal(again.f(x, u, p).full().ravel(), rates)


def test_algebraic_variables_stay():
    model = rumo.Model(
        states={"charge": "C"},
        inputs={"voltage": "V"},
        dynamics=lambda x, u, p: {"charge": x.current},
        algebraic={"current": rumo.Algebraic("A", lambda x, u, p: u.voltage - x.charge - 2.0 * x.current, guess=0.5)},
    )
    made = rumo.with_actuators(model, rumo.Actuation({"voltage": rumo.Actuator(lag=0.5)}))
    plant = rumo.Plant(made, 1.0)
    end = plant.advance(np.array([0.0, 1.0]), np.array([1.0]), np.zeros(0))
    assert end[0] == pytest.approx(1.0 - np.exp(-0.5), rel=1e-6)  # V = 1 throughout: q' = (1 - q) / 2
    assert made.algebraic_guess.tolist() == [0.5]


def test_a_car_that_steers_late_is_predicted():
    """Against the car whose steering rate comes later: the two states after a while are the same."""
    T, car = 0.06, rolling_bicycle(PASSENGER_CAR)
    late = rumo.with_actuators(car, rumo.Actuation({"steering_rate": rumo.Actuator(dead_time=T)}))
    start = {"v_x": 20.0}
    x = np.array([start.get(name, 0.0) for name in late.states])
    u, p = np.array([0.0, 0.2]), car.default_parameters
    predicted = rumo.Plant(late, 0.5).advance(x, u, p)[:7]
    before = rumo.Plant(car, T).advance(x[:7], np.zeros(2), p)
    exact = rumo.Plant(car, 0.5 - T).advance(before, u, p)
    np.testing.assert_allclose(predicted, exact, atol=2e-3)
    assert abs(exact[1]) > 0.2  # it has left the straight


def test_constraints_can_be_about_what_actuators_do():
    actuation = rumo.Actuation({"slow": rumo.Actuator(lag=0.1), "fast": rumo.Actuator(dead_time=0.0)})
    model = integrators()
    behind = rumo.with_actuators(model, actuation)
    expression = behind_actuators(lambda x, u, p: x.a + 10.0 * u.slow + 100.0 * u.fast, actuation, model.inputs)
    value = ca.Function("value", [behind.x, behind.u], [behind.written(expression, "test")])
    assert float(value([1.0, 0.0, 3.0], [2.0, 7.0])) == pytest.approx(1.0 + 30.0 + 200.0)


def test_path_problems_know_their_actuators():
    late = rumo.Actuation(
        {"torque": rumo.Actuator(dead_time=0.05), "steering_rate": rumo.Actuator(0.1, dead_time=0.07)}, 0.04
    )
    problem = path_problem(PASSENGER_CAR, actuation=late)
    assert problem.delay == 2
    plain = path_problem(PASSENGER_CAR)
    assert plain.delay == 1
    hidden = [name for name in problem.model.states if name not in plain.model.states]
    assert hidden == ["steering_rate_late", "steering_rate_later", "steering_rate_lag"]
    assert problem.constraint_names.names == plain.constraint_names.names


def test_misuse():
    with pytest.raises(rumo.UnknownNameError, match="actuation: got 'force'"):
        rumo.with_actuators(integrators(), rumo.Actuation({"force": rumo.Actuator()}))
    with pytest.raises(rumo.ArgumentError, match=r"model: got 'car', expected a rumo.Model"):
        rumo.with_actuators("car", rumo.Actuation())
    taken = rumo.Model({"force_lag": "N"}, {"force": "N"}, lambda x, u, p: {"force_lag": u.force})
    with pytest.raises(rumo.ArgumentError, match="force_lag"):
        rumo.with_actuators(taken, rumo.Actuation({"force": rumo.Actuator(lag=0.1)}))
