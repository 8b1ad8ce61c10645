"""CommonRoad's cars as plants: what their states mean, and that Rumo's controllers hold them."""

import pickle
import sys
from copy import deepcopy

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import rumo
from rumo.references import PathTracking, SpeedLimits, generators, speed_profile
from rumo.simulation import PlantLike
from rumo.vehicles import Acceleration, path_problem, rolling_bicycle

pytest.importorskip("vehiclemodels")
from rumo.simulation.plants import CommonRoadCar

FORMS = ("ks", "kst", "st", "std", "mb")
DYNAMIC = FORMS[2:]
G = 9.81


def car(model, vehicle=2, *, sampling_time=0.04):
    trailer = 3.0 if model == "kst" else None
    return CommonRoadCar(model, vehicle, sampling_time=sampling_time, trailer=trailer)


def parameters(plant, **changes):
    return np.array([changes.get(name, item.default) for name, item in plant.parameters.items()])


def state(plant, **motion):
    return plant.states.vector(plant.start(**motion), "x")


def seen(plant, x):
    """All that a state says, by name."""
    u, p = np.zeros(2), parameters(plant)
    return dict(zip(plant.states, x.tolist(), strict=True)) | plant.observe(x, u, p)


def driven(plant, duration, u, x, **changes):
    """States at all samples (K + 1, nx)."""
    path, p = [x], parameters(plant, **changes)
    for _ in range(round(duration / plant.sampling_time)):
        path.append(plant.advance(path[-1], np.array(u), p))
    return np.array(path)


@pytest.mark.parametrize("model", FORMS)
def test_it_has_all_that_a_bicycle_knows(model):
    plant, bicycle = car(model), rolling_bicycle(rumo.vehicles.PASSENGER_CAR, drive=Acceleration())
    assert isinstance(plant, PlantLike)
    assert plant.inputs.names == bicycle.inputs.names
    for name in (*bicycle.states, *bicycle.inputs):
        group = next(group for group in (plant.states, plant.inputs, plant.outputs) if name in group)
        assert group.unit(name) == bicycle.unit(name)


@given(
    st.sampled_from(DYNAMIC),
    st.fixed_dictionaries(
        {
            "p_x": st.floats(-1e3, 1e3),
            "p_y": st.floats(-1e3, 1e3),
            "psi": st.floats(-7.0, 7.0),
            "v_x": st.floats(1.0, 40.0),
            "v_y": st.floats(-5.0, 5.0),
            "omega": st.floats(-1.0, 1.0),
            "delta": st.floats(-0.5, 0.5),
        }
    ),
)
def test_it_begins_in_the_motion_given(model, motion):
    plant = car(model)
    found = seen(plant, state(plant, **motion))
    assert {name: found[name] for name in motion} == pytest.approx(motion, rel=1e-12, abs=1e-12)


@given(
    st.sampled_from(FORMS),
    st.integers(1, 3),
    st.floats(2.0, 30.0),
    st.floats(-0.1, 0.1),
    st.floats(-3.0, 2.0),
    st.floats(-0.3, 0.3),
)
def test_positions_are_the_integral_of_velocities(model, vehicle, speed, delta, acceleration, rate):
    """Of the centre of gravity, in the heading's frame: whichever point and angles a model has."""
    plant = car(model, vehicle, sampling_time=2e-3)
    x = state(plant, v_x=speed, v_y=0.02 * speed, delta=delta, psi=0.7, omega=speed * delta / 2.6)
    before, now, after = (seen(plant, at) for at in driven(plant, 4e-3, [acceleration, rate], x))
    cos, sin = np.cos(now["psi"]), np.sin(now["psi"])
    # Second differences of positions are accelerations, up to some 100 m/s^2 at first.
    for name, velocity in (
        ("p_x", now["v_x"] * cos - now["v_y"] * sin),
        ("p_y", now["v_x"] * sin + now["v_y"] * cos),
        ("psi", now["omega"]),
    ):
        assert (after[name] - before[name]) / 4e-3 == pytest.approx(velocity, abs=2e-3 + 1e-4 * speed)


@pytest.mark.parametrize("model", FORMS)
def test_parts_of_a_sample_make_a_sample(model):
    plant = car(model)
    x, u, p = state(plant, v_x=15.0), np.array([1.0, 0.3]), parameters(plant)
    parts = plant.advance(plant.advance(x, u, p, 0.011), u, p, 0.029)
    np.testing.assert_allclose(parts, plant.advance(x, u, p), rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("vehicle", [1, 2, 3])
@pytest.mark.parametrize("model", FORMS)
def test_derivatives_are_commonroads(model, vehicle):
    plant, rng = car(model, vehicle), np.random.default_rng(vehicle)
    module = pytest.importorskip(f"vehiclemodels.vehicle_dynamics_{model}")
    theirs = getattr(module, f"vehicle_dynamics_{model}")
    for _ in range(20):
        x = state(plant, v_x=rng.uniform(1.0, 30.0), delta=rng.uniform(-0.1, 0.1), omega=rng.uniform(-0.2, 0.2))
        x += 1e-3 * rng.standard_normal(len(x))
        acceleration, rate = rng.uniform([-12.0, -0.5], [12.0, 0.5])
        expected = theirs(x.tolist(), [rate, acceleration], plant.own)
        np.testing.assert_array_equal(plant.rates(x, np.array([acceleration, rate]), parameters(plant)), expected)


WHEELS = {"std": 2, "mb": 4}
"""That turn with the car: an axle of std has the inertia of one."""


def effective(plant):
    """Acceleration for each one commanded, of a car that moves its wheels as well."""
    own = plant.own
    return own.m / (own.m + WHEELS[plant.model] * own.I_y_w / own.R_w**2) if plant.model in WHEELS else 1.0


@pytest.mark.parametrize("model", FORMS)
def test_straight_ahead_a_motor_moves_mass_and_wheels(model):
    plant, T = car(model), 2.0
    path = driven(plant, T, [1.0, 0.0], state(plant, v_x=15.0, psi=0.3))
    acceleration = effective(plant)
    found = seen(plant, path[-1])
    assert found["v_x"] == pytest.approx(15.0 + acceleration * T, abs=0.01)
    distance = 15.0 * T + 0.5 * acceleration * T**2
    assert np.hypot(found["p_x"], found["p_y"]) == pytest.approx(distance, abs=0.02)
    assert np.arctan2(found["p_y"], found["p_x"]) == pytest.approx(0.3, abs=5e-3)  # tyres pull


def test_single_tracks_steer_as_textbooks_say():
    """Equal stiffness per load in front and behind is neutral: omega = v delta / l, at any speed."""
    plant = car("st", 1)
    own, v, delta = plant.own, 18.0, 0.02
    found = seen(plant, driven(plant, 4.0, [0.0, 0.0], state(plant, v_x=v, delta=delta))[-1])
    length, stiffness = own.a + own.b, -own.tire.p_ky1
    assert found["omega"] == pytest.approx(v * delta / length, rel=1e-6)
    assert found["v_y"] / v == pytest.approx(delta / length * (own.b - v**2 / (stiffness * G)), rel=1e-3)


@pytest.mark.parametrize("model", ["ks", "kst"])
def test_kinematic_cars_roll_about_a_point_beside_the_rear_axle(model):
    plant, delta, v = car(model), 0.1, 8.0
    own = plant.own
    found = [seen(plant, x) for x in driven(plant, 3.0, [0.0, 0.0], state(plant, v_x=v, delta=delta))]
    radius = (own.a + own.b) / np.tan(delta)
    for sample in found:
        assert np.hypot(sample["p_x"] + own.b, sample["p_y"] - radius) == pytest.approx(np.hypot(radius, own.b))
    assert np.hypot(found[-1]["v_x"], found[-1]["v_y"]) == pytest.approx(found[-1]["omega"] * np.hypot(radius, own.b))
    if model == "kst":  # at the hitch, on the rear axle, a trailer is tangent to a circle of its own
        settled = driven(plant, 20.0, [0.0, 0.0], state(plant, v_x=v, delta=delta))[-1]
        assert settled[5] == pytest.approx(-np.arcsin(own.trailer.l_wb / radius), abs=1e-6)


@pytest.mark.parametrize("model", ["std", "mb"])
def test_a_gentle_bend_is_that_of_the_linear_car(model):
    plant = car(model)
    v, delta = 10.0, 0.03  # 1.2 m/s^2 across
    found = seen(plant, driven(plant, 5.0, [0.0, 0.0], state(plant, v_x=v, delta=delta))[-1])
    assert found["omega"] == pytest.approx(found["v_x"] * delta / (plant.own.a + plant.own.b), rel=0.05)
    if model == "mb":  # a bend to the left: outer wheels are the right ones, and the car leans on them
        assert found["w_fr"] > found["w_fl"]
        assert found["w_rr"] > found["w_rl"]
        assert found["roll"] < -0.01


@pytest.mark.parametrize("model", ["std", "mb"])
@pytest.mark.parametrize("mu", [0.2, 0.6])
def test_friction_is_what_the_road_has(model, mu):
    plant = car(model)
    v = np.array([seen(plant, x)["v_x"] for x in driven(plant, 0.6, [-11.5, 0.0], state(plant, v_x=20.0), mu=mu)])
    tyre = plant.own.tire
    most = mu * (1.1739 / 1.0489) * G  # tyres hold more along than across
    assert tyre.p_dx1 == pytest.approx(most / G)
    slowed = (v[5] - v[-1]) / (plant.sampling_time * (len(v) - 6))
    # Wheels lock: tyres of this shape that slide keep sin(pi / 2 p_cx1) = 53 % of their grip, less where the car yaws.
    assert 0.5 * most < slowed < 1.01 * most


@pytest.mark.parametrize("model", ["st", "mb"])
def test_brakes_stop_a_car_and_leave_it_there(model):
    plant = car(model)
    path = driven(plant, 3.0, [-4.0, 0.0], state(plant, v_x=6.0))
    speeds = np.array([seen(plant, x)["v_x"] for x in path])
    assert speeds.min() > -1e-4
    assert np.abs(speeds[-20:]).max() < 1e-4
    assert np.hypot(*path[-1][:2]) == pytest.approx(6.0**2 / (2.0 * 4.0 * effective(plant)), rel=0.01)


def test_commonroads_limits_are_kept():
    plant = car("st", 3)
    found = seen(plant, driven(plant, 4.0, [-50.0, 3.0], state(plant, v_x=30.0, delta=0.0))[10])
    assert found["delta"] == pytest.approx(0.4 * 0.4)
    assert found["v_x"] == pytest.approx(30.0 - 11.5 * 0.4, rel=2e-2)
    ks = car("ks")
    assert seen(ks, driven(ks, 6.0, [0.0, 3.0], state(ks))[-1])["delta"] == pytest.approx(1.066, abs=1e-6)


def test_copies_drive_alike():
    plant = car("std")
    x = state(plant, v_x=10.0, delta=0.05)
    expected = driven(plant, 0.2, [1.0, 0.1], x)
    for other in (deepcopy(plant), pickle.loads(pickle.dumps(plant))):
        np.testing.assert_array_equal(driven(other, 0.2, [1.0, 0.1], x), expected)


def scenario(plant):
    own, drive, path = plant.car, Acceleration(), generators.figure_of_eight(30.0)
    profile = speed_profile(path, SpeedLimits.of_car(own, grip=0.6))
    here, speed = path.at(0.0), float(profile.speed_at(0.0))
    return rumo.Scenario(
        path_problem(own, drive=drive, sampling_time=plant.sampling_time),
        plant,
        plant.start(p_x=float(here.x), p_y=float(here.y), psi=float(here.heading), v_x=speed),
        PathTracking(path, profile),
        12.0,
        discretization=rumo.Radau2(),
        backend="portable",
        observed=rolling_bicycle(own, drive=drive),
    )


@pytest.mark.parametrize("model", DYNAMIC)
def test_a_prediction_of_ours_holds_them_in_their_lane(model):
    wanted = scenario(car(model))
    log = wanted.run()
    n = log["true_states"].sel(state="n").to_numpy()
    assert np.abs(n).max() < 0.15
    assert set(log["status"].to_numpy().tolist()) == {"OPTIMAL"}
    driven = np.diff(log["true_states"].sel(state="s").to_numpy()[[0, -1]])
    assert driven == pytest.approx(wanted.reference.profile.at_time(np.array([12.0]))[0], rel=0.03)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("sts",), "model: got 'sts', expected one of ks, kst, st, std, mb. Did you mean 'st"),
        (("mb", 4), "vehicle: got 4, expected a whole number of at most 3"),
        (("ks", 5), "vehicle: got 5, expected a whole number of at most 4"),
        (("kst", 1), "trailer: got None, expected the wheelbase of the trailer .* Vehicle 4 has one"),
        (("mb", 1, 0.04, 1e-8, 3.0), "trailer: got 3.0, expected none: mb has no trailer"),
        (("mb", 1, 0.0), "sampling_time: got 0.0"),
        (("mb", 1, 0.04, -1.0), "tolerance: got -1.0"),
    ],
)
def test_mistakes(arguments, message):
    names = ("model", "vehicle", "sampling_time", "tolerance", "trailer")
    given = {"sampling_time": 0.04} | dict(zip(names, arguments, strict=False))
    with pytest.raises(rumo.ArgumentError, match=message):
        CommonRoadCar(**given)


def test_a_motion_is_made_of_numbers():
    with pytest.raises(rumo.ArgumentError, match="v_x: got nan, expected a finite number"):
        car("mb").start(v_x=np.nan)


def test_the_truck_has_no_car_to_predict_with():
    assert CommonRoadCar("kst", 4, sampling_time=0.1).car is None


def test_without_the_package_one_is_told_how_to_get_it(monkeypatch):
    for name in [name for name in sys.modules if name.split(".")[0] == "vehiclemodels"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "vehiclemodels", None)
    with pytest.raises(rumo.ArgumentError, match=r'without vehiclemodels.* pip install "rumo\[commonroad\]"'):
        car("mb")


def test_a_spin_beyond_the_equations_is_an_error_of_the_plant():
    plant = car("mb")
    with pytest.raises(rumo.PlantError, match="The equations have no value"):
        driven(plant, 0.04, [0.0, 0.0], state(plant, v_x=0.5, omega=2.0))


@pytest.mark.parametrize("vehicle", [1, 2, 3])
def test_a_car_for_predictions_rolls_as_the_plant_does(vehicle):
    """At speed, with no torque, both keep rolling: drag would take 0.05 m/s."""
    plant = car("std", vehicle, sampling_time=0.1)
    start = state(plant, v_x=40.0)
    after = plant.advance(start, np.zeros(2), parameters(plant))
    model = rolling_bicycle(plant.car, drive=Acceleration())
    rolling = model.states.vector(dict.fromkeys(model.states, 0.0) | {"v_x": 40.0}, "x")
    rates = model.f(rolling, [0.0, 0.0], model.default_parameters).full().ravel()
    slower = seen(plant, after)["v_x"] - seen(plant, start)["v_x"]
    assert 0.1 * rates[model.states.index("v_x")] == pytest.approx(slower, abs=3e-3)
