"""Textbook models against their sources: operating point, conservation, published numbers, eigenvalues."""

import numpy as np
import pytest
from model_values import derivative, jacobian, vectors
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

from rumo.errors import ArgumentError
from rumo.simulation import Plant
from rumo.textbook import (
    cart_pendulum,
    gas_pipeline,
    heat_rod,
    mass_chain,
    robertson_dae,
    robertson_reactor,
    tubular_reactor,
    van_de_vusse_reactor,
    van_der_pol,
)


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


def parameters(model):
    """Defaults by name."""
    return dict(zip(model.parameters, model.default_parameters, strict=True))


@pytest.mark.parametrize("cells", [1, 8, 40])
def test_heat_rod_has_the_modes_of_the_closed_form(cells):
    model = heat_rod(cells)
    p = parameters(model)
    diffusivity, width = p["conductivity"] / (p["density"] * p["heat_capacity"]), p["length"] / cells
    # cos(angle (i - 1/2)) is flat at the heated end and vanishes at the other.
    angle = np.pi * (np.arange(cells) + 0.5) / cells
    expected = -4.0 * diffusivity / width**2 * np.sin(0.5 * angle) ** 2
    found = np.linalg.eigvals(jacobian(model, {}))
    np.testing.assert_allclose(np.sort(found), np.sort(expected), rtol=1e-9)
    # The slowest is that of the rod itself, but for the square of the cells' width.
    slowest = diffusivity * (0.5 * np.pi / p["length"]) ** 2
    assert -expected.max() == pytest.approx(slowest, rel=0.25 / cells**2)


def test_heat_rod_settles_on_a_straight_line():
    model = heat_rod(8)
    p = parameters(model)
    centres = (np.arange(8) + 0.5) / 8 * p["length"]
    profile = p["end_temperature"] + 2e4 / p["conductivity"] * (p["length"] - centres)
    x = dict(zip(model.states, profile, strict=True))
    assert np.max(np.abs(list(derivative(model, x, {"heating": 2e4}).values()))) < 1e-12
    # 20 of the slowest time constants from a cold start.
    end = advance(model, dict.fromkeys(model.states, 0.0), 7400.0, 740.0, u={"heating": 2e4})[-1]
    np.testing.assert_allclose(end, profile, rtol=1e-6)


FEED = 340.0 - 273.15


def steady_reactor(model, x):
    """The steady state near x (nx,), the jacket at the feed's temperature, and df/dx there."""
    u, p = [FEED], model.default_parameters
    scales = np.array(x)

    def slope(state):
        return jacobian(model, state, {"jacket": FEED}) * scales

    steady = scales * fsolve(
        lambda share: model.f(scales * share, u, p).full().ravel(), x / scales, fprime=lambda s: slope(scales * s)
    )
    assert np.max(np.abs(model.f(steady, u, p).full().ravel()) / scales) < 1e-9
    return steady, jacobian(model, steady, {"jacket": FEED})


@pytest.mark.parametrize(("damkoehler", "stable"), [(0.162, True), (0.167, False)])
def test_tubular_reactor_loses_its_stability_where_published(damkoehler, stable):
    """Heinemann and Poore (1981): an oscillation is born at a Damkoehler number of 0.165."""
    model = tubular_reactor(20)
    rate = list(model.parameters).index("rate")
    model.default_parameters[rate] = damkoehler * 0.01
    x = np.r_[np.linspace(4900.0, 2000.0, 20), np.linspace(72.0, 117.0, 20)]
    _, J = steady_reactor(model, x)
    slowest = max(np.linalg.eigvals(J), key=lambda value: value.real)
    assert (slowest.real < 0.0) == stable
    assert abs(slowest.imag) > 0.0


def test_tubular_reactor_neither_makes_nor_loses_energy():
    """Without cooling, heat of reaction and of what flows are all: concentration and heat add up to the feed's."""
    model = tubular_reactor(6)
    p = parameters(model)
    c, T = np.linspace(4800.0, 1500.0, 6), np.linspace(68.0, 147.0, 6)
    x = dict(zip(model.states, np.r_[c, T], strict=True))
    rates = np.array(list(derivative(model, x, {"jacket": 0.0}, {"heat_transfer": 0.0}).values()))
    energy = p["reaction_heat"] * rates[:6] + p["heat_capacity"] * rates[6:]
    enthalpy = p["reaction_heat"] * np.array([5000.0, c[-1]]) + p["heat_capacity"] * np.array([FEED, T[-1]])
    inflow = p["velocity"] * (enthalpy[0] - enthalpy[1])
    assert energy.sum() * p["length"] / 6 == pytest.approx(inflow, rel=1e-9)


@pytest.mark.parametrize("masses", [1, 12, 15])
def test_mass_chain_has_the_modes_of_the_closed_form(masses):
    model = mass_chain(masses)
    shape = 4.0 * np.sin(0.5 * np.pi * np.arange(1, masses + 1) / (masses + 1)) ** 2
    frequency, damping = np.sqrt(shape), 0.01 * shape
    expected = -0.5 * damping + 1j * np.sqrt(frequency**2 - 0.25 * damping**2)
    found = np.linalg.eigvals(jacobian(model, {}))
    found = found[found.imag > 0.0]
    np.testing.assert_allclose(found[np.argsort(found.imag)], expected[np.argsort(expected.imag)], rtol=1e-9)


def test_gas_pipeline_settles_on_a_root_of_a_straight_line():
    """Where the same flows everywhere, the squares of the pressures fall evenly."""
    model = gas_pipeline(6)
    p = parameters(model)
    area = np.pi / 4.0 * p["diameter"] ** 2
    drag = p["friction"] * p["length"] * (p["sound_speed"] / area) ** 2 / p["diameter"]  # Pa^2 per (kg/s)^2
    end = advance(model, dict.fromkeys(model.states, 52.0), 400_000.0, 20_000.0, u={"supply": 60.0})[-1]
    drop = drag * 60.0 * np.hypot(60.0, p["laminar_flow"]) * np.arange(6, 0, -1) / 6
    np.testing.assert_allclose(end * 1e5, np.sqrt((p["delivery_pressure"] * 1e5) ** 2 + drop), rtol=1e-6)


def test_gas_pipeline_stores_what_it_does_not_deliver():
    model = gas_pipeline(6)
    p = parameters(model)
    volume = np.pi / 4.0 * p["diameter"] ** 2 * p["length"]
    x = {f"p_{i + 1}": 60.0 - i for i in range(6)} | {f"q_{i + 1}": 50.0 + i for i in range(6)}
    rates = model.f(list(x.values()), [70.0], model.default_parameters).full().ravel()
    assert rates.mean() * 1e5 * volume / p["sound_speed"] ** 2 == pytest.approx(70.0 - 55.0)


@pytest.mark.parametrize("make", [heat_rod, tubular_reactor, mass_chain, gas_pipeline])
def test_a_model_has_as_many_parts_as_asked_for(make):
    assert len(make(3).states) == len(make(1).states) * 3
    with pytest.raises(ArgumentError, match="a whole number of at least 1"):
        make(0)
