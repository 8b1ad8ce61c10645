"""Four-wheel car: loads, Ackermann steering, symmetry, energy, friction limit, agreement with the bicycle."""

from dataclasses import replace
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from model_values import central_differences, derivative, jacobian, vectors

from rumo.vehicles import (
    PAPER_CAR,
    PASSENGER_CAR,
    Dugoff,
    LinearTyre,
    ModifiedDugoff,
    RearTorque,
    SaturatingTyre,
    dynamic_bicycle,
    four_wheel,
)
from rumo.vehicles.four_wheel import _ackermann, _loads
from rumo.vehicles.parameters import GRAVITY

# The paper gives no height of the centre of gravity.
CARS = {"paper": replace(PAPER_CAR, h=0.3), "passenger": PASSENGER_CAR}
TYRES = {"linear": LinearTyre(), "dugoff": Dugoff(), "modified": ModifiedDugoff(), "saturating": SaturatingTyre()}
WHEELS = ("w_fl", "w_fr", "w_rl", "w_rr")
both_cars = pytest.mark.parametrize("car", CARS.values(), ids=CARS.keys())
all_tyres = pytest.mark.parametrize("tyre", TYRES.values(), ids=TYRES.keys())


def rolling(car, speed, **others):
    """Straight running with wheels that roll."""
    return {"v_x": speed} | dict.fromkeys(WHEELS, speed / car.r) | others


def without_drag(car):
    return replace(car, b_lon=0.0, b_lat=0.0)


def random_motions(car, n, seed=0):
    """Vectors (nx, n), (nu, n), (np_, n) of driving, sliding, reversing and standing, without wind."""
    rng = np.random.default_rng(seed)
    spread = [50.0, 50.0, 3.0, 8.0, 3.0, 2.0, 20.0, 20.0, 20.0, 20.0]
    x = np.vstack([np.array(spread)[:, None] * rng.normal(size=(10, n)), rng.uniform(-0.7, 0.7, (1, n))])
    x[6:10, : n // 2] = x[3, : n // 2] / 0.6 + rng.normal(size=(4, n // 2))  # half of them near rolling
    x[3:10, ::10] *= 0.01  # some near standstill
    return x, np.vstack([rng.uniform(-300.0, 300.0, n), rng.uniform(-1.5, 1.5, n)]), road(car, np.zeros(n), np.zeros(n))


def road(car, wind_speed, wind_direction):
    """Parameters (np_, n), of the car's own friction."""
    return np.vstack([wind_speed, wind_direction, np.full(len(wind_speed), car.mu)])


@both_cars
def test_static_loads_carry_the_weight_and_balance_about_the_centre(car):
    assert 2.0 * (car.front_load + car.rear_load) == pytest.approx(car.m * GRAVITY)
    assert car.front_load * car.l_f == pytest.approx(car.rear_load * car.l_r)


@both_cars
@pytest.mark.parametrize("delta", [-0.7, -0.1, 1e-6, 0.3, 0.78])
def test_axes_of_the_front_wheels_meet_on_the_rear_axle(car, delta):
    tan_delta = _ackermann(delta, car)
    # The centre of the turn lies on the rear axle at R = L / tan(delta) to the left.
    radius = car.wheelbase / np.tan(delta)
    assert tan_delta["fl"] == pytest.approx(car.wheelbase / (radius - car.t_w), rel=1e-12)
    assert tan_delta["fr"] == pytest.approx(car.wheelbase / (radius + car.t_w), rel=1e-12)


@both_cars
def test_wheels_point_straight_ahead_without_steering(car):
    assert _ackermann(0.0, car) == {"fl": 0.0, "fr": 0.0}


@both_cars
@all_tyres
@pytest.mark.parametrize("speed", [8.0, -2.0])
@pytest.mark.parametrize("radius", [3.0, 20.0, -5.0])
def test_rolling_about_the_centre_of_the_turn_needs_no_tyre_force(car, tyre, speed, radius):
    car = without_drag(car)
    omega = speed / radius
    # Each wheel moves at right angles to its line to the centre (-l_r, R) and rolls.
    x = {"v_x": speed, "v_y": omega * car.l_r, "omega": omega, "delta": np.arctan(car.wheelbase / radius)}
    for wheel, left in (("l", car.t_w), ("r", -car.t_w)):
        x[f"w_f{wheel}"] = np.hypot(speed - left * omega, omega * car.wheelbase) * np.sign(speed) / car.r
        x[f"w_r{wheel}"] = (speed - left * omega) / car.r
    xdot = derivative(four_wheel(car, tyre), x)
    # Rounding of the slips, 1e-16, times C_s r / J of 2e6; the wheels' turn of the body frame is all that remains.
    assert xdot["v_x"] == pytest.approx(omega * x["v_y"], abs=1e-8)
    assert xdot["v_y"] == pytest.approx(-omega * speed, abs=1e-8)
    for name in ("omega", *WHEELS):
        assert xdot[name] == pytest.approx(0.0, abs=1e-8)


@both_cars
@all_tyres
@pytest.mark.parametrize("load_transfer", [False, True])
def test_straight_driving_stays_straight(car, tyre, load_transfer):
    model = four_wheel(car, tyre, load_transfer=load_transfer)
    xdot = derivative(model, rolling(car, 8.0, w_rl=8.1 / car.r, w_rr=8.1 / car.r), {"torque": 80.0})
    for name in ("p_y", "psi", "v_y", "omega"):
        # Left and right moments of up to 1e5 N m cancel but for their rounding.
        assert xdot[name] == pytest.approx(0.0, abs=1e-9)
    assert xdot["w_fl"] == xdot["w_fr"]
    assert xdot["w_rl"] == xdot["w_rr"]
    assert xdot["v_x"] > 0.0


@both_cars
@all_tyres
@pytest.mark.parametrize("load_transfer", [False, True])
def test_mirrored_motion_has_the_mirrored_derivative(car, tyre, load_transfer):
    model = four_wheel(car, tyre, load_transfer=load_transfer)
    names = list(model.states)
    order = [names.index(name) for name in (*names[:6], "w_fr", "w_fl", "w_rr", "w_rl", "delta")]
    sign = np.array([-1.0 if name in ("p_y", "psi", "v_y", "omega", "delta") else 1.0 for name in names])[:, None]
    x, u, _ = random_motions(car, 200)
    p = road(car, np.full(200, 4.0), np.linspace(-3.0, 3.0, 200))
    here = model.f(x, u, p).full()
    # Steering rate and wind direction change sign with the picture.
    there = model.f(sign * x[order], u * [[1.0], [-1.0]], p * [[1.0], [-1.0], [1.0]]).full()
    # Sums run in another order: rounding of the largest term of each motion.
    size = np.abs(here).max(axis=0)
    assert np.max(np.abs(there - sign * here[order]) / size) < 1e-12


@both_cars
@all_tyres
@pytest.mark.parametrize("load_transfer", [False, True])
def test_tyres_and_drag_only_take_energy_away(car, tyre, load_transfer):
    model = four_wheel(car, tyre, load_transfer=load_transfer)
    x, u, p = random_motions(car, 2000)
    xdot = model.f(x, u, p).full()
    inertia = np.array([0.0, 0.0, 0.0, car.m, car.m, car.I, *[car.J] * 4, 0.0])[:, None]
    terms = inertia * x * xdot  # of d/dt (m v^2 + I omega^2 + J sum w^2) / 2
    delivered = u[0] * (x[8] + x[9])
    # Power of single terms reaches 1e10 W with linear tyres: rounding relative to the largest.
    assert np.all(terms.sum(axis=0) - delivered <= 1e-12 * np.abs(terms).max(axis=0))


@both_cars
# The modified Dugoff tyre peaks at 1.24 mu F_z with the paper's stiffness, 1.08 mu F_z with an ordinary one.
@pytest.mark.parametrize(("tyre", "factor"), [(Dugoff(), 1.0), (ModifiedDugoff(), 1.25)], ids=["dugoff", "modified"])
def test_tyres_together_stay_within_friction(car, tyre, factor):
    x, u, p = random_motions(car, 2000, seed=1)
    xdot = four_wheel(without_drag(car), tyre).f(x, u, p).full()
    acceleration = np.hypot(xdot[3] - x[5] * x[4], xdot[4] + x[5] * x[3])
    assert acceleration.max() <= factor * car.front.mu * GRAVITY * (1.0 + 1e-9)
    # The motions reach the limit, or the bound would say little.
    assert acceleration.max() > 0.9 * car.front.mu * GRAVITY


@both_cars
def test_locked_wheels_decelerate_at_mu_g(car):
    xdot = derivative(four_wheel(without_drag(car), Dugoff()), {"v_x": 20.0})
    # 1 + sigma is eps^2 / (2 v^2) = 1e-5 instead of zero.
    assert xdot["v_x"] == pytest.approx(-car.front.mu * GRAVITY, rel=1e-5)


@both_cars
@pytest.mark.parametrize("speed", [8.0, -3.0])
def test_four_wheels_equal_the_bicycle_in_straight_running(car, speed):
    front, rear = 1.001 * speed / car.r, 1.002 * speed / car.r
    u, p = {"torque": 50.0, "steering_rate": 0.1}, {"wind_speed": 3.0, "wind_direction": 1.0}
    body = {"psi": 0.4, "v_x": speed}
    four = derivative(
        four_wheel(car, LinearTyre()), body | {"w_fl": front, "w_fr": front, "w_rl": rear, "w_rr": rear}, u, p
    )
    two = derivative(dynamic_bicycle(car), body | {"w_f": front, "w_r": rear}, u, p)
    for name in ("p_x", "p_y", "psi", "v_x", "v_y", "omega", "delta"):
        assert four[name] == pytest.approx(two[name], rel=1e-12, abs=1e-9)
    for axle in ("f", "r"):
        assert four[f"w_{axle}l"] == four[f"w_{axle}r"] == pytest.approx(two[f"w_{axle}"], rel=1e-12)


def gentle_curve(car):
    """Four-wheel and bicycle derivatives in a curve of 80 m with small slips; wheels of an axle turn alike."""
    speed, omega = 8.0, 0.1
    front, rear = 8.01 / car.r, 8.02 / car.r
    body = {"v_x": speed, "v_y": 0.09, "omega": omega, "delta": 0.024}
    four = derivative(four_wheel(car, LinearTyre()), body | {"w_fl": front, "w_fr": front, "w_rl": rear, "w_rr": rear})
    two = derivative(dynamic_bicycle(car), body | {"w_f": front, "w_r": rear})
    four |= {"w_f": 0.5 * (four["w_fl"] + four["w_fr"]), "w_r": 0.5 * (four["w_rl"] + four["w_rr"])}
    return four, two


@both_cars
def test_narrow_four_wheel_car_is_the_bicycle_in_a_gentle_curve(car):
    four, two = gentle_curve(replace(car, t_w=1e-5))
    for name in two:
        # The square of the half-track, 1e-10 m^2, times C_s omega / (v I) of 1e3.
        assert four[name] == pytest.approx(two[name], rel=1e-6, abs=1e-6)


@both_cars
@pytest.mark.parametrize("name", ["v_x", "v_y", "omega", "w_f"])
def test_bicycle_errs_by_the_square_of_the_track_only(car, name):
    errors = []
    for t_w in (0.2, 0.1):
        four, two = gentle_curve(replace(car, t_w=t_w))
        errors.append(four[name] - two[name])
    # Next come terms of fourth order, (t_w omega / v)^2 = 1e-5 of the second.
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=1e-2)


@pytest.mark.parametrize("torque", [-300.0, 0.0, 200.0])
@pytest.mark.parametrize(("v_x", "omega"), [(0.0, 0.0), (15.0, 0.3), (15.0, -0.3), (-4.0, 0.5)])
def test_load_transfer_keeps_the_weight_and_balances_the_moments(torque, v_x, omega):
    car = PASSENGER_CAR
    push = 2.0 * torque / car.r
    loads = {name: float(load) for name, load in _loads(SimpleNamespace(v_x=v_x, omega=omega), push, car, True).items()}
    assert sum(loads.values()) == pytest.approx(car.m * GRAVITY)
    pitch = (loads["rl"] + loads["rr"]) * car.l_r - (loads["fl"] + loads["fr"]) * car.l_f
    roll = (loads["fr"] + loads["rr"] - loads["fl"] - loads["rl"]) * car.t_w
    # Inertia at the height h tips backwards under the push, and to the right in a left curve.
    assert pitch == pytest.approx(car.h * push, abs=1e-8)
    assert roll == pytest.approx(car.h * car.m * v_x * omega, abs=1e-8)


def test_lifted_wheel_keeps_a_positive_load():
    loads = _loads(SimpleNamespace(v_x=40.0, omega=2.0), 5000.0, PASSENGER_CAR, True)
    assert min(float(load) for load in loads.values()) > 0.0


def test_load_transfer_gives_the_outer_wheels_more_brake_force():
    # All wheels locked in a fast left curve: the tyres' limits follow their loads, the outer side brakes more and
    # turns the car to the right.
    x = {"v_x": 20.0, "omega": 0.3}
    static, moved = (derivative(four_wheel(PASSENGER_CAR, Dugoff(), load_transfer=flag), x) for flag in (False, True))
    assert moved["omega"] < static["omega"]
    assert moved["v_x"] == pytest.approx(static["v_x"], rel=1e-2)


@pytest.mark.parametrize("load_transfer", [False, True])
def test_axle_torque_is_shared_by_two_wheels(load_transfer):
    x, u, p = random_motions(PASSENGER_CAR, 20)
    per_wheel = four_wheel(PASSENGER_CAR, load_transfer=load_transfer).f(x, u, p).full()
    per_axle = (
        four_wheel(PASSENGER_CAR, drive=RearTorque(axle=True), load_transfer=load_transfer)
        .f(x, u * [[2.0], [1.0]], p)
        .full()
    )
    np.testing.assert_array_equal(per_axle, per_wheel)


def test_outputs_are_mean_wheel_speeds():
    model = four_wheel(PAPER_CAR)
    x, _, _ = vectors(model, {"w_fl": 1.0, "w_fr": 3.0, "w_rl": 10.0, "w_rr": 14.0})
    outputs = ca.Function("outputs", [model.x], [model.expression("w_f", ""), model.expression("w_r", "")])
    assert [float(value) for value in outputs(x)] == [2.0, 12.0]


EXTREMES = {
    "standstill": {},
    "standstill_steered": {"delta": 0.78, "psi": 1.0},
    "spinning_wheels": {"w_rl": 50.0, "w_rr": 50.0},
    "wheels_against_motion": {"v_x": 5.0} | dict.fromkeys(WHEELS, -20.0),
    "reverse": {"v_x": -3.0, "v_y": 0.1, "omega": -0.2, "delta": -0.3} | dict.fromkeys(WHEELS, -5.0),
    "turning_on_the_spot": {"omega": 2.0, "delta": 0.5},
    "sideways": {"v_y": 8.0},
}
every_extreme = pytest.mark.parametrize("x", EXTREMES.values(), ids=EXTREMES.keys())


@both_cars
@all_tyres
@every_extreme
def test_dynamics_and_derivatives_are_finite(car, tyre, x):
    model = four_wheel(car, tyre, load_transfer=True)
    assert np.isfinite(list(derivative(model, x).values())).all()
    assert np.isfinite(jacobian(model, x)).all()


@both_cars
@pytest.mark.parametrize(("speed", "turns"), [(5.0, 1.0), (-5.0, -1.0)])
def test_steering_left_turns_left_forwards_and_right_in_reverse(car, speed, turns):
    assert derivative(four_wheel(car), rolling(car, speed, delta=0.2))["omega"] * turns > 0.0


@both_cars
@all_tyres
@pytest.mark.parametrize(
    "x",
    [
        {"v_x": 8.0, "v_y": 0.3, "omega": 0.4, "w_fl": 13.2, "w_fr": 13.5, "w_rl": 13.4, "w_rr": 13.6, "delta": 0.1},
        {"v_x": -3.0, "v_y": 0.1, "omega": -0.2, "delta": -0.3} | dict.fromkeys(WHEELS, -5.1),
        {"v_x": 1.0, "v_y": 0.5, "omega": 0.4, "psi": 1.0},
        {},
    ],
    ids=["cornering", "reverse", "locked", "standstill"],
)
def test_derivatives_against_finite_differences(car, tyre, x):
    model = four_wheel(car, tyre)
    # Where the paper's tyres begin to slide at standstill is a slip of 4e-4, 4e-5 m/s: the step stays below it.
    step = 1e-8 if not x else 1e-6
    exact, estimate = jacobian(model, x), central_differences(model, x, step=step)
    size = np.maximum(np.abs(exact).max(axis=1, keepdims=True), 1e-6)
    assert np.max(np.abs(exact - estimate) / size) < 1e-5
