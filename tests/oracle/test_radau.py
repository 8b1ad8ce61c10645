"""The core's Radau method against SUNDIALS, closed forms and published solutions."""

import casadi as ca
import numpy as np
import pytest
from scipy.linalg import expm

import rumo
from rumo.registry import MODELS
from rumo.simulation import Plant
from rumo.textbook import gas_pipeline, heat_rod, mass_chain, robertson_dae, robertson_reactor, tubular_reactor

REST = {
    "heat_rod": lambda name: 25.0,
    "tubular_reactor": lambda name: 4000.0 if name.startswith("c") else 72.0,
    "gas_pipeline": lambda name: 62.0 - 0.2 * float(name.removeprefix("p_")),
    "van_de_vusse_reactor": {"c_a": 2.14, "c_b": 1.09, "temperature": 114.2, "jacket": 112.9}.get,
    "van_der_pol": {"position": 1.5, "speed": -1.2}.get,
    "cart_pendulum": {"angle": 0.3, "speed": 0.1}.get,
    "robertson_reactor": {"a": 0.8, "b": 2e-5, "c": 0.2}.get,
    "robertson_dae": {"a": 0.8, "b": 2e-5}.get,
    "mass_chain": {"x_1": 0.5, "v_1": 0.2}.get,
}
SAMPLES = {"gas_pipeline": 30.0, "robertson_reactor": 2.0, "robertson_dae": 2.0}
SCALES = {"robertson_reactor": {"b": 1e-5}, "robertson_dae": {"b": 1e-5}}
PUSHES = {"gas_pipeline": 0.1, "robertson_reactor": 0.01, "robertson_dae": 0.01}


def beginning(model):
    """A state near which the model is used."""
    if "v_x" in model.states:
        return np.array(
            [{"v_x": 8.0, "psi": 0.3}.get(name, 24.0 if name[:2] == "w_" else 0.02) for name in model.states]
        )
    return np.array([REST[model.name](name) or 0.0 for name in model.states])


def compared(model, samples=6):
    """States after each sample of inputs that jump, by the core and by SUNDIALS."""
    rng, step = np.random.default_rng(3), SAMPLES.get(model.name, 0.05)
    scales = SCALES.get(model.name)
    fast = Plant(model, step, 1e-9, scales, "radau5")
    exact = Plant(model, step, 1e-11 if len(model.algebraic) else 1e-12, scales, "sundials")
    x, states = beginning(model), []
    for k in range(samples):
        level = PUSHES.get(model.name, 1.0)
        u = level * rng.uniform(0.0, 1.0, len(model.inputs)) * (k % 3 != 2)
        states.append((fast.advance(x, u, model.default_parameters), exact.advance(x, u, model.default_parameters)))
        x = states[-1][0]
    return [np.array(side) for side in zip(*states, strict=True)]


@pytest.mark.parametrize("name", MODELS)
def test_every_model_goes_where_sundials_leads(name):
    fast, exact = compared(MODELS[name]())
    np.testing.assert_allclose(fast, exact, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize(
    "model", [gas_pipeline(20), heat_rod(100), mass_chain(30), tubular_reactor(50)], ids=lambda model: model.name
)
def test_in_many_parts(model):
    """By sparse factors."""
    fast, exact = compared(model, samples=3)
    np.testing.assert_allclose(fast, exact, rtol=1e-8, atol=1e-8)


def dense(n, rate):
    """A system in which everything depends on everything, some of it `rate` times faster."""
    rng = np.random.default_rng(n)
    Q, _ = np.linalg.qr(rng.normal(size=(n, n)))
    A = Q @ np.diag(-np.geomspace(1.0, rate, n)) @ Q.T + np.triu(rng.normal(size=(n, n)), 1)
    names = [f"x{i}" for i in range(n)]
    model = rumo.Model(
        dict.fromkeys(names, "1"),
        {"u": "1"},
        lambda x, u, p: {
            names[i]: sum(float(A[i, j]) * x[names[j]] for j in range(n)) + (i + 1.0) * u.u for i in range(n)
        },
        name="dense",
    )
    return model, A, np.arange(1.0, n + 1.0)


@pytest.mark.parametrize("rate", [1.0, 1e4, 1e7])
@pytest.mark.parametrize("n", [1, 3, 9, 20])
def test_linear_system_against_the_matrix_exponential(n, rate):
    model, A, b = dense(n, rate)
    plant, step, x = Plant(model, 0.1, method="radau5"), 0.1, np.ones(n)
    exact = x
    for u in (0.3, 0.3, -0.2, 0.0):
        augmented = expm(step * np.block([[A, (b * u)[:, None]], [np.zeros((1, n + 1))]]))
        exact = augmented[:n, :n] @ exact + augmented[:n, n]
        x = plant.advance(x, np.array([u]), np.zeros(0))
    np.testing.assert_allclose(x, exact, rtol=0.0, atol=2e-8 * np.abs(exact).max())


ROBERTSON = [0.2083340149701255e-7, 0.8333360770334713e-13, 0.9999999791665050]
"""At t = 1e11 (Mazzia and Magherini, Test Set for Initial Value Problem Solvers, 2008)."""


@pytest.mark.parametrize("model", [robertson_reactor(), robertson_dae()], ids=lambda model: model.name)
def test_robertson_over_eleven_decades(model):
    plant = Plant(model, 1e11, 1e-11, {"a": 1e-8, "b": 1e-14}, "radau5")
    x = np.zeros(len(model.states))
    x[0] = 1.0
    end = plant.advance(x, np.zeros(1), model.default_parameters)
    np.testing.assert_allclose(end, ROBERTSON[: len(end)], rtol=2e-5)


def test_van_der_pol_with_jumps():
    """With epsilon = 1e-6, as published for t = 2 (Hairer and Wanner, 1996, section IV.10)."""
    model = rumo.Model(
        {"position": "1", "speed": "1"},
        {"push": "1"},
        lambda x, u, p: {"position": x.speed, "speed": ((1.0 - x.position**2) * x.speed - x.position + u.push) / 1e-6},
        name="stiff_van_der_pol",
    )
    end = Plant(model, 2.0, 1e-11, method="radau5").advance(np.array([2.0, 0.0]), np.zeros(1), np.zeros(0))
    np.testing.assert_allclose(end, [1.706167732170469, -0.8928097010248125], rtol=1e-8)


def test_long_runs_stay_as_exact():
    """A sample goes on with step, Jacobian and solution of the one before: as exact as one that begins anew."""
    model = rumo.Model(
        {"angle": "rad", "rate": "rad/s", "motor": "1/s^2"},
        {"torque": "1/s^2"},
        lambda x, u, p: {
            "angle": x.rate,
            "rate": x.motor - 9.0 * ca.sin(x.angle) - 0.1 * x.rate,
            "motor": 500.0 * (u.torque - x.motor),
        },
        name="motor",
    )
    going, x = Plant(model, 0.02, method="radau5"), np.array([0.5, 0.0, 0.0])
    anew, y = Plant(model, 0.02, method="radau5"), x
    exact, z = Plant(model, 0.02, 1e-12, method="sundials"), x
    for k in range(400):
        u = np.array([3.0 * np.sin(0.05 * k) + (k % 50 == 0)])
        anew.reset()
        x, y, z = (plant.advance(state, u, np.zeros(0)) for plant, state in ((going, x), (anew, y), (exact, z)))
    assert np.abs(x - z).max() < 1e-8
    assert np.abs(y - z).max() < 1e-8
