"""Textbook models against their sources: operating point, conservation, published numbers, eigenvalues."""

import numpy as np
import pytest
from model_values import derivative, jacobian, vectors
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

from rumo.simulation import Plant
from rumo.textbook import cart_pendulum, robertson_dae, robertson_reactor, van_de_vusse_reactor, van_der_pol


def advance(model, x, duration, step, u=None, p=None):
    """States (K + 1, nx) over a run of the plant."""
    plant = Plant(model, step)
    x, u, p = vectors(model, x, u, p)
    states = [x]
    for _ in range(round(duration / step)):
        states.append(plant.advance(states[-1], u, p))
    return np.array(states)


COOLED = {"c_a": 2.14, "c_b": 1.09, "temperature": 114.2, "jacket": 112.9}
COOLED_INPUT = {"flow": 14.19, "cooling": -1113.5}


def test_van_de_vusse_equilibrium_is_the_published_one():
    model = van_de_vusse_reactor()
    x, u, p = vectors(model, COOLED, COOLED_INPUT)
    # Rates per hour are of the order of the states, which fsolve likes.
    equilibrium = fsolve(lambda state: 3600.0 * model.f(state, u, p).full().ravel(), x, xtol=1e-10)
    # Equal to the last printed digit.
    assert np.round(equilibrium[:2], 2).tolist() == [2.14, 1.09]
    assert np.round(equilibrium[2:], 1).tolist() == [114.2, 112.9]


def test_van_de_vusse_rates_vanish_at_the_published_point():
    model = van_de_vusse_reactor()
    rates = np.array(list(derivative(model, COOLED, COOLED_INPUT).values()))
    # A natural rate: each state against its own decay. The printed digits are good to 0.5 %.
    natural = np.abs(np.diag(jacobian(model, COOLED, COOLED_INPUT))) * np.array(list(COOLED.values()))
    assert np.max(np.abs(rates) / natural) < 0.005


def test_van_de_vusse_without_reaction_only_flows():
    # At -200 degC no reaction runs; the rest is what the flow brings in and takes out.
    x = {"c_a": 1.0, "c_b": 0.5, "temperature": -200.0, "jacket": -200.0}
    rates = derivative(van_de_vusse_reactor(), x, {"flow": 36.0})
    assert rates["c_a"] == pytest.approx(0.01 * (5.1 - 1.0))
    assert rates["c_b"] == pytest.approx(-0.01 * 0.5)
    assert rates["temperature"] == pytest.approx(0.01 * (104.9 + 200.0))
    assert rates["jacket"] == 0.0


def test_robertson_reaches_the_published_state_at_40_s():
    end = advance(robertson_reactor(), {"a": 1.0}, 40.0, 1.0)[-1]
    # Hairer and Wanner (1996), ch. IV.1, printed to four digits.
    np.testing.assert_allclose(end, [0.7158, 9.185e-6, 0.2841], rtol=1e-3)


def test_robertson_agrees_with_radau():
    model = robertson_reactor()
    x, u, p = vectors(model, {"a": 1.0})
    result = solve_ivp(
        lambda t, y: model.f(y, u, p).full().ravel(),
        (0.0, 40.0),
        x,
        "Radau",
        jac=lambda t, y: jacobian(model, y),
        rtol=1e-10,
        atol=1e-14,
    )
    # The plant's absolute tolerance of 1e-8 is 1e-3 of the intermediate b; a stiff decay keeps it far below that.
    np.testing.assert_allclose(advance(model, {"a": 1.0}, 40.0, 1.0)[-1], result.y[:, -1], rtol=1e-4)


@pytest.mark.parametrize("x", [{"a": 1.0}, {"a": 0.3, "b": 2e-5, "c": 0.7}])
def test_robertson_closed_system_keeps_its_mass(x):
    model = robertson_reactor()
    # Each term leaves one species and enters another: zero but for the rounding of terms below 0.1.
    assert sum(derivative(model, x).values()) == pytest.approx(0.0, abs=1e-16)
    # Linear invariants pass through a multistep method but for the tolerance of its iterations.
    np.testing.assert_allclose(advance(model, x, 40.0, 1.0).sum(axis=1), sum(x.values()), rtol=1e-9)


def test_robertson_dilution_brings_the_feed_in():
    rates = derivative(robertson_reactor(), {"a": 0.6, "b": 1e-5, "c": 0.4}, {"dilution": 0.1})
    closed = derivative(robertson_reactor(), {"a": 0.6, "b": 1e-5, "c": 0.4})
    assert rates["a"] - closed["a"] == pytest.approx(0.1 * (1.0 - 0.6))
    assert rates["c"] - closed["c"] == pytest.approx(-0.1 * 0.4)


CART, BOB, LENGTH, GRAVITY = 1.0, 0.1, 0.5, 9.81


def pendulum_energy(states):
    """Kinetic and potential energy [J] from the velocities of cart and bob."""
    _, speed, angle, rate = states.T
    bob_x = speed + LENGTH * rate * np.cos(angle)
    bob_y = -LENGTH * rate * np.sin(angle)
    return 0.5 * CART * speed**2 + 0.5 * BOB * (bob_x**2 + bob_y**2) + BOB * GRAVITY * LENGTH * np.cos(angle)


def test_free_cart_pendulum_keeps_energy_and_momentum():
    states = advance(cart_pendulum(), {"speed": 0.3, "angle": 0.5, "rate": 1.0}, 5.0, 0.05)
    energy = pendulum_energy(states)
    momentum = (CART + BOB) * states[:, 1] + BOB * LENGTH * states[:, 3] * np.cos(states[:, 2])
    # 100 restarts at a tolerance of 1e-8 each; the pendulum falls through its whole swing of about 1 J.
    np.testing.assert_allclose(energy, energy[0], atol=1e-5)
    np.testing.assert_allclose(momentum, momentum[0], atol=1e-5)
    assert np.ptp(states[:, 2]) > np.pi


def test_force_does_the_work_that_the_energy_shows():
    x = {"speed": 0.7, "angle": 0.5, "rate": 1.0}
    rates = np.array(list(derivative(cart_pendulum(), x, {"force": 3.0}).values()))
    state = np.array([0.0, *x.values()])
    change = pendulum_energy((state + 1e-6 * rates)[None]) - pendulum_energy((state - 1e-6 * rates)[None])
    # Central difference along the motion: 1e-12 by curvature, 1e-10 by rounding.
    assert change[0] / 2e-6 == pytest.approx(3.0 * 0.7, rel=1e-8)


@pytest.mark.parametrize("angle", [0.0, np.pi])
def test_cart_pendulum_rests_upright_and_hanging(angle):
    # sin(pi) is 1e-16 in floating point.
    assert np.max(np.abs(list(derivative(cart_pendulum(), {"angle": angle}).values()))) < 1e-14


def test_upright_is_unstable_with_the_closed_form_eigenvalue():
    eigenvalues = np.sort(np.linalg.eigvals(jacobian(cart_pendulum(), {})).real)
    growth = np.sqrt((CART + BOB) * GRAVITY / (CART * LENGTH))
    # The double zero of the free cart splits by the root of the rounding error.
    np.testing.assert_allclose(eigenvalues, [-growth, 0.0, 0.0, growth], atol=1e-6)


def test_hanging_swings_with_the_closed_form_frequency():
    eigenvalues = np.linalg.eigvals(jacobian(cart_pendulum(), {"angle": np.pi}))
    assert np.max(eigenvalues.imag) == pytest.approx(np.sqrt((CART + BOB) * GRAVITY / (CART * LENGTH)))


def test_robertson_dae_is_the_same_reaction():
    x, duration = {"a": 0.9, "b": 2e-5, "c": 0.09998}, 20.0
    whole = advance(robertson_reactor(), x, duration, 1.0, u={"dilution": 0.01})[-1]
    reduced = advance(robertson_dae(), {"a": 0.9, "b": 2e-5}, duration, 1.0, u={"dilution": 0.01})[-1]
    np.testing.assert_allclose(reduced, whole[:2], rtol=1e-4)


def test_van_der_pol_reaches_the_published_states():
    states = advance(van_der_pol(), {"position": 2.0, "speed": -0.66}, 2.0, 1.0)
    # Hairer and Wanner (1996), ch. IV.10: reference solutions at t = 1 and 2.
    np.testing.assert_allclose(states[1], [-1.863646254808130, 0.7535430865435460], rtol=1e-4)
    np.testing.assert_allclose(states[2], [1.706167732170456, -0.8928097010248257], rtol=1e-4)
