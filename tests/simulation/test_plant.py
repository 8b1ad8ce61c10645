"""The plant's integration against closed forms, and its failure."""

import copy
import pickle

import casadi as ca
import numpy as np
import pytest
from problems import pendulum
from scipy.linalg import expm

import rumo
from rumo.simulation import Plant
from rumo.vehicles import PASSENGER_CAR, ModifiedDugoff, dynamic_bicycle, four_wheel

NOTHING = np.zeros(0)


def linear_model(A, b):
    """The system xdot = A x + b u."""
    n = len(A)
    return rumo.Model(
        states={f"x{i}": "1" for i in range(n)},
        inputs={"u": "1"},
        dynamics=lambda x, u, p: {
            f"x{i}": sum(float(A[i, j]) * x[f"x{j}"] for j in range(n)) + float(b[i]) * u.u for i in range(n)
        },
        name="linear",
    )


def test_exponential_decay():
    model = rumo.Model(
        {"x": "1"},
        {"u": "1"},
        lambda x, u, p: {"x": -p.rate * x.x + u.u},
        {"rate": rumo.Parameter("1/s", 1.0)},
    )
    plant = Plant(model, 0.5)
    end = plant.advance(np.array([3.0]), np.array([0.8]), np.array([2.0]))
    # The tolerance of 1e-8 holds for each step of some fifty.
    assert end[0] == pytest.approx(0.4 + 2.6 * np.exp(-1.0), abs=1e-6)


@pytest.mark.parametrize("fast", [1.0, 1e3, 1e6])
def test_stiff_linear_system_against_the_matrix_exponential(fast):
    # A slow oscillation coupled to a fast decay.
    A = np.array([[-0.2, 2.0, 0.1], [-2.0, -0.2, 0.0], [0.5 * fast, 0.3 * fast, -fast]])
    b = np.array([0.0, 1.0, 0.5])
    plant, step, u = Plant(linear_model(A, b), 0.2), 0.2, np.array([0.7])
    augmented = expm(step * np.block([[A, (b * u[0])[:, None]], [np.zeros((1, 4))]]))
    x = exact = np.array([1.0, -0.5, 0.2])
    for _ in range(5):
        x = plant.advance(x, u, NOTHING)
        exact = augmented[:3, :3] @ exact + augmented[:3, 3]
    np.testing.assert_allclose(x, exact, atol=2e-6)


def test_tighter_tolerance_is_closer():
    A = np.array([[0.0, 3.0], [-3.0, 0.0]])
    exact = expm(A) @ [1.0, 0.0]
    errors = [
        np.abs(
            Plant(linear_model(A, np.zeros(2)), 1.0, tolerance).advance([1.0, 0.0], np.zeros(1), NOTHING) - exact
        ).max()
        for tolerance in (1e-4, 1e-7, 1e-10)
    ]
    assert errors[0] > 10.0 * errors[1] > 100.0 * errors[2]


def test_same_start_gives_the_same_end():
    plant = Plant(linear_model(np.array([[-1.0]]), np.ones(1)), 0.1)
    first = plant.advance(np.array([1.0]), np.array([0.3]), NOTHING)
    plant.advance(np.array([50.0]), np.array([-9.0]), NOTHING)
    np.testing.assert_array_equal(plant.advance(np.array([1.0]), np.array([0.3]), NOTHING), first)


def test_escape_to_infinity_raises():
    # xdot = x^2 from 1 reaches infinity at t = 1.
    model = rumo.Model({"x": "1"}, {"u": "1"}, lambda x, u, p: {"x": x.x**2}, name="escape")
    with pytest.raises(rumo.PlantError, match="escape"):
        Plant(model, 2.0).advance(np.array([1.0]), np.zeros(1), NOTHING)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_input_that_is_not_finite_raises(bad):
    plant = Plant(linear_model(np.array([[-1.0]]), np.ones(1)), 0.1)
    with pytest.raises(rumo.PlantError, match="linear"):
        plant.advance(np.array([1.0]), np.array([bad]), NOTHING)


@pytest.mark.parametrize(("x", "u"), [(np.inf, 1.0), (1.7e308, 1e308)])
def test_end_that_is_not_finite_raises(x, u):
    # The integration itself goes well: the state starts at or passes beyond the largest number.
    model = rumo.Model({"x": "1"}, {"u": "1"}, lambda x, u, p: {"x": u.u}, name="integrator")
    with pytest.raises(rumo.PlantError, match="integrator left the finite numbers"):
        Plant(model, 2.0).advance(np.array([x]), np.array([u]), NOTHING)


def test_plant_survives_a_failure():
    model = rumo.Model({"x": "1"}, {"u": "1"}, lambda x, u, p: {"x": x.x**2 + u.u}, name="escape")
    plant = Plant(model, 0.5)
    fresh = plant.advance(np.array([0.1]), np.zeros(1), NOTHING)
    with pytest.raises(rumo.PlantError):
        plant.advance(np.array([100.0]), np.zeros(1), NOTHING)
    np.testing.assert_array_equal(plant.advance(np.array([0.1]), np.zeros(1), NOTHING), fresh)


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e6])
def test_scales_keep_small_states_exact(size):
    model = rumo.Model(
        states={"a": "1", "b": "1"},
        inputs={"push": "1"},
        dynamics=lambda x, u, p: {"a": x.b, "b": -x.a + 0.0 * u.push},
    )
    plant = Plant(model, 1.0, tolerance=1e-10, scales={"a": size, "b": size})
    end = plant.advance(np.array([size, 0.0]), np.zeros(1), np.zeros(0))
    np.testing.assert_allclose(end / size, [np.cos(1.0), -np.sin(1.0)], atol=1e-8)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"sampling_time": 0.0}, "sampling_time: got 0.0, expected a positive"),
        ({"sampling_time": 0.1, "tolerance": -1.0}, "tolerance: got -1.0, expected a positive"),
        ({"sampling_time": 0.1, "scales": {"angle": 0.0}}, "scales"),
        (
            {"sampling_time": 0.1, "method": "euler"},
            "method: got 'euler', expected one of 'auto', 'radau5', 'sundials'",
        ),
    ],
)
def test_settings_are_checked(settings, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        Plant(pendulum().model, **settings)


@pytest.mark.parametrize("method", ["radau5", "sundials"])
@pytest.mark.parametrize("duration", [0.0, -0.1, np.nan, np.inf, "1"])
def test_durations_are_checked(duration, method):
    plant = Plant(linear_model(np.array([[-1.0]]), np.ones(1)), 0.1, method=method)
    with pytest.raises(rumo.ArgumentError, match=r"duration: got .*, expected a positive"):
        plant.advance(np.array([1.0]), np.zeros(1), NOTHING, duration)


def test_algebraic_variables():
    """A capacitor charged through a resistor, the current an algebraic variable: a closed form."""
    model = rumo.Model(
        states={"charge": "C"},
        inputs={"voltage": "V"},
        dynamics=lambda x, u, p: {"charge": x.current},
        algebraic={"current": rumo.Algebraic("A", lambda x, u, p: u.voltage - 2.0 * x.current - x.charge / 0.5)},
    )
    plant = Plant(model, 0.7, tolerance=1e-10, scales={"current": 0.1})
    end = plant.advance(np.array([0.3]), np.array([1.0]), NOTHING)
    assert end[0] == pytest.approx(0.5 - 0.2 * np.exp(-0.7), abs=1e-8)


def test_the_nearest_root_is_followed():
    """Of z^2 = x, the root that the guess names, at later steps too."""
    model = rumo.Model(
        states={"x": "1", "sum": "1"},
        inputs={"u": "1"},
        dynamics=lambda x, u, p: {"x": u.u, "sum": x.root},
        algebraic={"root": rumo.Algebraic("1", lambda x, u, p: x.root**2 - x.x, guess=-1.0)},
    )
    plant, x = Plant(model, 1.0, tolerance=1e-10), np.array([1.0, 0.0])
    for _ in range(8):
        x = plant.advance(x, np.array([1.0]), NOTHING)
    # The integral of -sqrt(1 + t).
    assert x[1] == pytest.approx(-2.0 / 3.0 * (9.0**1.5 - 1.0), rel=1e-7)


def root_of_level():
    """A tank whose outflow has no slope where it is empty: SUNDIALS gets away from there, the core does not."""
    return rumo.Model(
        {"level": "m"}, {"inflow": "m/s"}, lambda x, u, p: {"level": u.inflow - ca.sqrt(ca.fabs(x.level))}, name="tank"
    )


def test_sundials_takes_the_samples_in_which_the_core_fails():
    plant, exact = Plant(root_of_level(), 0.5), Plant(root_of_level(), 0.5, 1e-12, method="sundials")
    alone, x, y = Plant(root_of_level(), 0.5, method="radau5"), np.zeros(1), np.zeros(1)
    with pytest.raises(rumo.PlantError, match=r"tank .* no finite value"):
        alone.advance(x, np.array([0.7]), NOTHING)
    for _ in range(4):
        x, y = plant.advance(x, np.array([0.7]), NOTHING), exact.advance(y, np.array([0.7]), NOTHING)
        np.testing.assert_allclose(x, y, atol=1e-7)
    # From where there is a slope the core goes on.
    np.testing.assert_allclose(alone.advance(y, np.array([0.7]), NOTHING), exact.advance(y, np.array([0.7]), NOTHING))


def test_models_with_other_operations_are_for_sundials():
    model = rumo.Model({"x": "1"}, {"u": "1"}, lambda x, u, p: {"x": ca.erfinv(0.5 * ca.tanh(x.x)) + u.u})
    with pytest.raises(rumo.ArgumentError, match="method: got 'radau5', but the core lacks OP_ERFINV"):
        Plant(model, 0.1, method="radau5")
    x, u = np.array([0.3]), np.array([0.1])
    ends = [Plant(model, 0.1, method=method).advance(x, u, NOTHING) for method in ("auto", "sundials")]
    np.testing.assert_array_equal(*ends)


def path_of(plant, seed):
    rng, x, path = np.random.default_rng(seed), np.array([0.4, 0.0]), []
    for k in range(40):
        u = rng.normal(size=1)
        x = (
            plant.advance(x, u, plant.default_parameters)
            if k % 4
            else plant.advance(x, u, plant.default_parameters, 0.013)
        )
        path.append(x)
    return np.array(path)


def test_a_run_has_the_same_bits_whatever_the_plant_did_before():
    plant = Plant(pendulum().model, 0.05)
    alone = path_of(plant, 1)
    path_of(plant, 2)
    plant.reset()
    np.testing.assert_array_equal(path_of(plant, 1), alone)
    for other in (copy.copy(plant), pickle.loads(pickle.dumps(plant))):
        np.testing.assert_array_equal(path_of(other, 1), alone)


def test_a_state_of_another_run_is_a_new_start():
    plant, u = Plant(pendulum().model, 0.05), np.array([0.5])
    path_of(plant, 3)
    fresh = Plant(pendulum().model, 0.05).advance(np.array([1.0, 0.2]), u, plant.default_parameters)
    np.testing.assert_array_equal(plant.advance(np.array([1.0, 0.2]), u, plant.default_parameters), fresh)


def test_wrong_shapes_raise():
    plant = Plant(pendulum().model, 0.05)
    with pytest.raises(rumo.ShapeError, match=r"x, u, p: got \(3,\), \(1,\), \(\d,\), expected \(2,\), \(1,\)"):
        plant.advance(np.zeros(3), np.zeros(1), plant.default_parameters)


def test_what_is_observed_is_what_the_model_says():
    model = four_wheel(PASSENGER_CAR)
    names = ("v_x", "course", "w_rl", "friction_use_fl")
    observe, rng = Plant(model, 0.05).observer(names), np.random.default_rng(0)
    kept = []
    for _ in range(3):
        x, u = rng.uniform(1.0, 2.0, len(model.states)), rng.normal(size=len(model.inputs))
        rows = ca.Function(
            "rows", [model.x, model.u, model.p], [ca.vertcat(*(model.expression(n, "n") for n in names))]
        )
        kept.append((observe(x, u, model.default_parameters), rows(x, u, model.default_parameters).full().ravel()))
    for seen, said in kept:  # each has an array of its own
        np.testing.assert_allclose(seen, said, rtol=1e-14)
    assert Plant(model, 0.05).observer(())(x, u, model.default_parameters).shape == (0,)


CARS = {
    "paper": lambda: four_wheel(rumo.vehicles.PAPER_CAR),
    "four_wheel": lambda: four_wheel(PASSENGER_CAR, load_transfer=True),
    "kinks": lambda: dynamic_bicycle(PASSENGER_CAR, ModifiedDugoff()),
}


@pytest.mark.parametrize("car", CARS)
@pytest.mark.parametrize("speed", [0.01, 8.0])
def test_a_car_skids_and_stops(car, speed):
    """Locked and spinning wheels, torques that jump, down to walking speed: by the core, without SUNDIALS."""
    model = CARS[car]()
    names = list(model.states)
    plant, exact = Plant(model, 0.05, method="radau5"), Plant(model, 0.05, 1e-10, method="sundials")
    for seed in range(5):
        rng, x = np.random.default_rng(seed), np.zeros(len(names))
        x[names.index("v_x")] = speed
        wheels = [i for i, name in enumerate(names) if name.startswith("w_")]
        x[wheels] = speed / 0.3 * rng.choice([0.0, 1.0, 3.0], len(wheels))
        plant.reset()
        for k in range(60):
            if k % 6 == 0:
                u = np.array([800.0, 0.5]) * rng.uniform(-1.0, 1.0, 2)
            before, x = x, plant.advance(x, u, model.default_parameters)
            if k % 20 == 5:
                np.testing.assert_allclose(x, exact.advance(before, u, model.default_parameters), rtol=1e-6, atol=1e-6)
