"""What grows is followed however small it is, against closed forms and CVODES.

The steps of an L-stable method may not be so long that they damp it.
"""

import casadi as ca
import numpy as np
import pytest
from scipy.linalg import block_diag, expm

import rumo
from rumo.simulation import Plant

SMALL = (1e-9, 1e-12, 1e-30)
NONE = np.zeros(0)


def linear(A):
    """The system xdot = A x."""
    names = [f"x{i}" for i in range(len(A))]
    return rumo.Model(
        dict.fromkeys(names, "1"),
        {"u": "1"},
        lambda x, u, p: {
            name: sum(float(a) * x[other] for a, other in zip(row, names, strict=True) if a) + 0.0 * u.u
            for name, row in zip(names, A, strict=True)
        },
        name="linear",
    )


def turning(growth, speed):
    return np.array([[growth, speed], [-speed, growth]])


def mixed(*blocks):
    """These blocks, each state a mixture of all."""
    A = block_diag(*blocks)
    T = np.eye(len(A)) + 0.3 * np.random.default_rng(1).normal(size=A.shape)
    return T @ A @ np.linalg.inv(T)


SYSTEMS = {
    "one": np.array([[5.0]]),
    "two": np.diag([5.0, 3.0]),
    "upright": np.array([[0.0, 1.0], [9.81, 0.0]]),
    "pair": turning(2.0, 3.0),
    "pair that turns fast": turning(0.5, 30.0),
    "beside fast ones": mixed(np.array([[2.0]]), np.diag([-1e4, -3e3]), turning(-100.0, 300.0)),
    "pairs beside fast ones": mixed(turning(1.5, 4.0), turning(0.7, 1.0), np.diag([-1e6, -1e3, 0.0])),
    "none in a loop": np.array([[3.0, 0.0, 1.0], [2.0, -1.0, 0.0], [0.0, 0.0, -1e5]]),
}
SPANS = [(10.0, 1), (1.0, 10), (0.1, 100)]


def grown(model, x, step, samples):
    plant = Plant(model, step, method="radau5")
    for _ in range(samples):
        x = plant.advance(x, np.zeros(1), NONE)
    return x


@pytest.mark.parametrize(("step", "samples"), SPANS)
@pytest.mark.parametrize("name", SYSTEMS)
def test_modes_grow_as_they_should(name, step, samples):
    A = SYSTEMS[name]
    model, start = linear(A), np.linspace(1.0, 0.5, len(A))
    exact = expm(step * samples * A) @ start
    for size in SMALL:
        end = grown(model, size * start, step, samples) / size
        np.testing.assert_allclose(end, exact, rtol=0.0, atol=5e-6 * np.abs(exact).max())


def test_many_that_exchange_energy_while_one_grows():
    """By sparse factors."""
    n = 40
    A = np.diag(np.full(n - 1, 8.0), 1) - np.diag(np.full(n - 1, 8.0), -1) - 0.1 * np.eye(n)
    A[0, 0] = 9.0
    start = np.ones(n)
    exact = expm(5.0 * A) @ start
    end = grown(linear(A), 1e-12 * start, 5.0, 1) / 1e-12
    np.testing.assert_allclose(end, exact, rtol=0.0, atol=5e-6 * np.abs(exact).max())


UPRIGHT = rumo.Model(
    {"angle": "rad", "rate": "rad/s"},
    {"push": "1/s^2"},
    lambda x, u, p: {"angle": x.rate, "rate": 9.81 * ca.sin(x.angle) - 0.1 * x.rate + u.push},
    name="upright",
)
CONSTRAINED = rumo.Model(
    {"place": "m", "speed": "m/s"},
    {"push": "1"},
    lambda x, u, p: {"place": x.speed, "speed": x.force + u.push},
    algebraic={
        "force": rumo.Algebraic("1", lambda x, u, p: x.force + ca.sin(x.force) - 18.0 * ca.sin(x.place), guess=0.0)
    },
    name="constrained",
)
SUPERCRITICAL = rumo.Model(
    {"across": "1", "turn": "1/s", "speed": "m/s"},
    {"push": "1"},
    lambda x, u, p: {
        "across": -3.0 * x.across - x.speed * x.turn,
        "turn": -0.5 * x.speed * x.across - 3.0 * x.turn + 0.0 * u.push,
        "speed": 0.8 * (20.0 - x.speed),
    },
    name="supercritical",
)


@pytest.mark.parametrize(("step", "samples"), [(6.0, 1), (1.0, 6), (0.05, 120)])
@pytest.mark.parametrize("size", [1e-9, 1e-12])
@pytest.mark.parametrize(("model", "rest"), [(UPRIGHT, [0.0]), (CONSTRAINED, [0.0])], ids=["upright", "constrained"])
def test_a_pendulum_falls(model, rest, size, step, samples):
    x = np.array([size, *rest])
    fine = dict.fromkeys(model.variables, 1e-9)
    exact = Plant(model, 6.0, 1e-11 if len(model.algebraic) else 1e-12, fine, "sundials")
    np.testing.assert_allclose(
        grown(model, x, step, samples), exact.advance(x, np.zeros(1), NONE), rtol=2e-6, atol=1e-6 * size
    )


@pytest.mark.parametrize(("step", "samples"), [(4.0, 1), (0.04, 100)])
def test_a_car_that_becomes_unstable_as_it_goes_faster(step, samples):
    """Small motions across, stable below some 4 m/s, beside a speed that is not small."""
    x = np.array([1e-9, 0.0, 4.2])
    exact = Plant(SUPERCRITICAL, 4.0, 1e-12, {"across": 1e-9, "turn": 1e-9}, "sundials")
    end = exact.advance(x, np.zeros(1), NONE)
    assert np.abs(end[:2]).max() > 1.0
    np.testing.assert_allclose(grown(SUPERCRITICAL, x, step, samples), end, rtol=2e-3)


def test_an_input_makes_a_mode_grow():
    model = rumo.Model({"x": "1"}, {"u": "1"}, lambda x, u, p: {"x": u.u * x.x}, name="steered")
    plant, x = Plant(model, 1.0, method="radau5"), np.array([1e-12])
    for u in (-0.2, 5.0, 4.0):
        x = plant.advance(x, np.array([u]), NONE)
    assert x[0] == pytest.approx(1e-12 * np.exp(8.8), rel=1e-5)


@pytest.mark.parametrize(("step", "samples"), [(5.0, 1), (0.5, 10), (0.05, 100)])
@pytest.mark.parametrize("offset", [0.0, 100.0, 1000.0])
def test_growth_that_depends_on_a_state_is_seen_however_large_that_is(offset, step, samples):
    """By a clock that begins at `offset`."""
    model = rumo.Model(
        {"clock": "1", "x": "1"},
        {"u": "1"},
        lambda x, u, p: {"clock": 1.0 + 0.0 * u.u, "x": (x.clock - offset) * x.x},
        name="clocked",
    )
    end = grown(model, np.array([offset, 1e-9]), step, samples)
    np.testing.assert_allclose(end, [offset + 5.0, 1e-9 * np.exp(12.5)], rtol=1e-3)


@pytest.mark.parametrize("n", [32, 33, 100])
def test_an_input_makes_one_of_many_in_a_loop_grow(n):
    names = [f"x{i}" for i in range(n)]
    ring = 1e-3 * (np.roll(np.eye(n), 1, axis=1) - np.roll(np.eye(n), -1, axis=1)) - np.diag(np.arange(n) > 0).astype(
        float
    )
    model = rumo.Model(
        dict.fromkeys(names, "1"),
        {"u": "1"},
        lambda x, u, p: {
            name: sum(float(a) * x[names[j]] for j, a in enumerate(row) if a) + (u.u * x.x0 if name == "x0" else 0.0)
            for name, row in zip(names, ring, strict=True)
        },
        name="ring",
    )
    plant, x, exact = Plant(model, 1.0, method="radau5"), np.full(n, 1e-12), np.full(n, 1e-12)
    for u in (-0.2, -0.2, 5.0, 4.0):
        x = plant.advance(x, np.array([u]), NONE)
        exact = expm(ring + u * np.diag(np.arange(n) == 0)) @ exact
    np.testing.assert_allclose(x, exact, rtol=0.0, atol=5e-6 * exact.max())


def test_a_mode_too_fast_to_be_followed_is_named_and_left_to_sundials():
    model, x = linear(block_diag(turning(1.0, 6e4), -1.0)), np.array([0.0, 0.0, 1.0])
    with pytest.raises(rumo.PlantError, match=r"too many steps.* grows at 1 1/s and turns at 6e\+04 rad/s.*sundials"):
        Plant(model, 0.5, method="radau5").advance(x, np.zeros(1), NONE)
    np.testing.assert_allclose(Plant(model, 0.5).advance(x, np.zeros(1), NONE), [0.0, 0.0, np.exp(-0.5)], atol=1e-7)


@pytest.mark.parametrize("model", [UPRIGHT, CONSTRAINED, linear(SYSTEMS["pairs beside fast ones"])], ids=str)
def test_nothing_stays_nothing(model):
    end = grown(model, np.zeros(len(model.states)), 1.0, 20)
    np.testing.assert_array_equal(end, 0.0)


def steps_for(A, x, span):
    plant = Plant(linear(A), span, method="radau5")
    plant.advance(np.array(x), np.zeros(1), NONE)
    return plant._core.work["steps"]


@pytest.mark.parametrize(
    "A",
    [
        np.array([[0.0, 1.0], [-1e4, 0.0]]),
        np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]),
        mixed(np.diag([-1e5, -1.0, 0.0, 0.0]), turning(-1e-3, 500.0)),
        np.array([[-1.0, 1e6], [0.0, -1.0]]),
        np.array([[-2.0, 1e6, 0.0], [0.0, -2.0, 1e3], [1e-12, 0.0, -2.0]]),
    ],
    ids=["conserves", "integrates", "stiff", "leans", "leans in a loop"],
)
def test_what_does_not_grow_costs_nothing(A):
    assert steps_for(A, np.full(len(A), 1e-30), 10.0) == 1
