"""The bicycle whose wheels roll, by its position and by its place beside a path."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from model_values import derivative

import rumo
from rumo.vehicles import (
    PASSENGER_CAR,
    VEHICLES,
    Dugoff,
    LinearTyre,
    ModifiedDugoff,
    UpToPeak,
    dynamic_bicycle,
    four_wheel,
    frenet_bicycle,
    friction_ellipses,
    rolling_bicycle,
    slip_limits,
)
from rumo.vehicles.parameters import GRAVITY

CAR = PASSENGER_CAR


def values(model, expressions, x, u=None, p=None):
    """Constraints at a state."""
    arguments = (
        model.states.vector(dict.fromkeys(model.states, 0.0) | x, "x"),
        model.inputs.vector(dict.fromkeys(model.inputs, 0.0) | (u or {}), "u"),
        model.parameter_vector(p or {}),
    )
    rows = [model.written(item.expression, name) for name, item in expressions.items()]
    found = model.packed(rows)(*arguments).full().ravel()
    return dict(zip(expressions, found.tolist(), strict=True))


@pytest.mark.parametrize("name", VEHICLES)
def test_without_slip_it_is_the_bicycle_with_wheels(name):
    """Torques that wheels hand on to the road, at small slip: the wheels' own inertia aside."""
    car = replace(VEHICLES[name], h=0.0)
    x = {"v_x": 12.0, "v_y": 0.1, "omega": 0.05, "psi": 0.4, "delta": 0.01}
    rolling = derivative(rolling_bicycle(car, LinearTyre(), load_transfer=False), x, p={"wind_speed": 3.0})
    # Wheels that turn as their axles move have no slip along the car.
    turning = {"w_f": (12.0 * np.cos(0.01) + (0.1 + car.l_f * 0.05) * np.sin(0.01)) / car.r, "w_r": 12.0 / car.r}
    spinning = derivative(dynamic_bicycle(car), {**x, **turning}, p={"wind_speed": 3.0})
    for state in rolling:
        assert rolling[state] == pytest.approx(spinning[state], rel=1e-6, abs=1e-9), state


def test_a_torque_pushes_and_friction_is_left_for_the_side():
    car = replace(CAR, J=1e-9)
    model = rolling_bicycle(car, Dugoff(), load_transfer=False)
    x = {"v_x": 20.0, "v_y": -4.0}  # sliding: the tyres give all they can
    coasting, braking = (derivative(model, x, {"torque": torque}) for torque in (0.0, -1200.0))
    pushed = -2.0 * 1200.0 / (CAR.r * CAR.m)
    assert braking["v_x"] - coasting["v_x"] == pytest.approx(pushed, rel=1e-9)
    assert 0.0 < braking["v_y"] < coasting["v_y"]
    # What is left is the circle's: mu sqrt(1 - (F_x / (mu F_z))^2), axle by axle, as Dugoff makes of it.
    left = 0.0
    for share, load, tyre in ((0.66, CAR.front_load, CAR.front), (0.34, CAR.rear_load, CAR.rear)):
        F_x = share * 1200.0 / CAR.r
        friction = CAR.mu * np.sqrt(1.0 - (F_x / (CAR.mu * load)) ** 2)
        demand = tyre.C_a * 4.0 / np.hypot(20.0, 0.1)
        left += 2.0 * friction * load * (1.0 - friction * load / (4.0 * demand))
    q = -4.0 * abs(4.0)
    assert braking["v_y"] == pytest.approx((left - CAR.b_lat * q) / CAR.m, rel=1e-3)


@pytest.mark.parametrize("v_y", [-1.2, -2.0, -3.0])
def test_load_transfer_costs_grip_as_in_the_four_wheel_car(v_y):
    """Cornering near the limit: forces across are those of the car with four wheels, which has loads of its own."""
    x = {"v_x": 25.0, "v_y": v_y, "omega": 0.36, "delta": 0.05}
    # Wheels that roll as they are moved, in their own planes.
    left, front = CAR.t_w * 0.36, (v_y + CAR.l_f * 0.36) * np.sin(0.05)
    rolling = {"rl": 25.0 - left, "rr": 25.0 + left, "fl": 25.0 - left + front, "fr": 25.0 + left + front}
    four = {**x, **{f"w_{wheel}": speed / CAR.r for wheel, speed in rolling.items()}}
    plant, bicycle, static = (
        derivative(model, state)["v_y"] + 25.0 * 0.36
        for model, state in (
            (four_wheel(CAR, load_transfer=True), four),
            (rolling_bicycle(CAR, ModifiedDugoff()), x),
            (rolling_bicycle(CAR, ModifiedDugoff(), load_transfer=False), x),
        )
    )
    assert bicycle == pytest.approx(plant, rel=5e-3)
    assert static > 1.03 * plant


def test_a_path_that_turns_is_the_same_motion():
    """Derivatives beside a circle are those by position, seen from the circle."""
    radius, n, error = 40.0, 1.5, 0.1
    common = {"v_x": 14.0, "v_y": -0.3, "omega": 0.3, "delta": 0.05}
    world = derivative(
        rolling_bicycle(CAR),
        {**common, "psi": 0.7 + error},
        {"torque": 200.0},
        {"wind_speed": 4.0, "wind_direction": 2.0},
    )
    beside = derivative(
        frenet_bicycle(CAR),
        {**common, "n": n, "heading_error": error},
        {"torque": 200.0},
        {"wind_speed": 4.0, "wind_direction": 2.0, "curvature": 1.0 / radius, "heading": 0.7},
    )
    tangent = np.array([np.cos(0.7), np.sin(0.7)])
    ground = np.array([world["p_x"], world["p_y"]])
    assert beside["s"] * (1.0 - n / radius) == pytest.approx(ground @ tangent)
    assert beside["n"] == pytest.approx(ground @ [-tangent[1], tangent[0]])
    assert beside["heading_error"] == pytest.approx(world["psi"] - beside["s"] / radius)
    for state in ("v_x", "v_y", "omega", "delta"):
        assert beside[state] == pytest.approx(world[state])


@pytest.mark.parametrize("torque", [-1000.0, 300.0])
def test_wheels_take_their_share_of_a_torque(torque):
    """Acceleration and forces of the tyres are those of the car whose wheels have speeds of their own."""
    plant = rumo.Plant(four_wheel(CAR, load_transfer=True), 0.2)
    wheels = [name for name in plant.states if name.startswith("w_")]
    start = dict.fromkeys(plant.states, 0.0) | {"v_x": 20.0} | dict.fromkeys(wheels, 20.0 / CAR.r)
    states = [plant.states.vector(start, "x")]
    for _ in range(2):
        states.append(plant.advance(states[-1], [torque, 0.0], plant.default_parameters))
    v = [dict(zip(plant.states, x, strict=True))["v_x"] for x in states[1:]]
    found = derivative(rolling_bicycle(CAR), {"v_x": 0.5 * (v[0] + v[1])}, {"torque": torque})
    # Drag is taken to slow down the body alone.
    drag = (CAR.rolling_mass / CAR.m - 1.0) * CAR.b_lon * 20.0**2 / CAR.m
    assert found["v_x"] == pytest.approx((v[1] - v[0]) / 0.2, rel=2e-3, abs=1.1 * drag)


def test_ellipses_are_full_where_the_limit_is():
    light = replace(CAR, J=1e-9)
    model = rolling_bicycle(light, LinearTyre())
    ellipses = friction_ellipses(light, LinearTyre())
    # Braking straight ahead: the axle with the larger share of its load is full first.
    for torque in (-800.0, -1400.0):
        push = 2.0 * torque / CAR.r
        to_rear = 0.5 * CAR.h / CAR.wheelbase * push
        full = {
            "friction_front": (0.5 * 0.66 * push / (CAR.mu * (CAR.front_load - to_rear))) ** 2 - 1.0,
            "friction_rear": (0.5 * 0.34 * push / (CAR.mu * (CAR.rear_load + to_rear))) ** 2 - 1.0,
        }
        assert values(model, ellipses, {"v_x": 30.0}, {"torque": torque}) == pytest.approx(full, rel=1e-3)
    # In a bend, a driven wheel spins where the inner one has no load left.
    turning = {"v_x": 25.0, "omega": 0.35}
    used = values(model, ellipses, turning, {"torque": 400.0})
    transfer = CAR.l_f / CAR.wheelbase * CAR.m * CAR.h * 25.0 * 0.35 / (2.0 * CAR.t_w)
    to_rear = CAR.h / CAR.wheelbase * 400.0 / CAR.r
    inner = CAR.rear_load + to_rear - transfer
    side = values(model, ellipses, turning)["friction_rear"]
    assert used["friction_rear"] == pytest.approx(side + (400.0 / (CAR.r * CAR.mu * inner)) ** 2, rel=0.2)


def test_limits_of_slip_are_at_their_slip():
    model, largest = rolling_bicycle(CAR, load_transfer=False), 2.5
    slip = largest * CAR.mu * CAR.front_load / CAR.front.C_a
    at_limit = {"v_x": 20.0, "delta": float(np.arctan(slip))}
    found = values(model, slip_limits(CAR, load_transfer=False, largest=largest), at_limit)
    assert found["slip_front"] == pytest.approx(0.0, abs=1e-3)
    assert found["slip_rear"] == pytest.approx(-1.0, abs=1e-9)


def test_a_tyre_up_to_its_peak_never_falls():
    tyre, plain = UpToPeak(ModifiedDugoff()), ModifiedDugoff()
    slips = np.linspace(0.0, 1.0, 400)
    forces = np.array([float(tyre.force(CAR.front, 0.0, t, CAR.front_load, CAR.mu)[1]) for t in slips])
    full = np.array([float(plain.force(CAR.front, 0.0, t, CAR.front_load, CAR.mu)[1]) for t in slips])
    assert (np.diff(forces) > -1e-3 * full.max()).all()
    assert forces.max() == pytest.approx(full.max(), rel=0.02)
    np.testing.assert_allclose(forces[slips < 0.08], full[slips < 0.08], rtol=0.02)


finite = st.floats(-1.0, 1.0)


@settings(max_examples=100, deadline=None)
@given(v_x=st.floats(-10.0, 60.0), v_y=finite, omega=finite, delta=finite, torque=st.floats(-3000.0, 3000.0))
def test_slopes_are_finite_everywhere(v_x, v_y, omega, delta, torque):
    model = frenet_bicycle(CAR)
    x = model.states.vector(
        {"s": 0.0, "n": 0.0, "heading_error": 0.1, "v_x": v_x, "v_y": v_y, "omega": omega, "delta": delta}, "x"
    )
    assert np.isfinite(model.jacobian()(x, [torque, 0.0], model.default_parameters).full()).all()


def test_outputs_tell_the_motion():
    model = rolling_bicycle(CAR)
    x = model.states.vector({**dict.fromkeys(model.states, 0.0), "psi": 0.5, "v_x": 12.0, "v_y": -0.9}, "x")
    names = ("course", "speed", "velocity_x", "velocity_y")
    found = model.packed([model.expression(name, "test") for name in names])(x, [0.0, 0.0], model.default_parameters)
    course = 0.5 + np.arctan2(-0.9, 12.0)
    speed = np.hypot(12.0, 0.9)
    expected = [course, speed, speed * np.cos(course), speed * np.sin(course)]
    np.testing.assert_allclose(found.full().ravel(), expected, rtol=1e-5)


@pytest.mark.parametrize("model", [rolling_bicycle(CAR), frenet_bicycle(CAR), four_wheel(CAR)], ids=lambda m: m.name)
def test_a_standing_car_has_a_course_too(model):
    at_rest = np.zeros(len(model.states))
    rows = model.packed([model.expression(name, "test") for name in model.outputs])
    arguments = at_rest, np.zeros(len(model.inputs)), model.default_parameters
    assert np.isfinite(rows(*arguments).full()).all()
    for slope in rows.jacobian()(*arguments, 0.0):
        assert np.isfinite(slope.full()).all()


def test_a_car_leans_no_more_than_its_weight():
    # A braking torque beyond anything a road takes leaves the rear wheels some load, and the model finite.
    model = rolling_bicycle(CAR)
    rates = derivative(model, {"v_x": 30.0, "omega": 0.5, "delta": 0.1}, {"torque": -20_000.0})
    assert all(np.isfinite(rate) for rate in rates.values())
    assert GRAVITY * CAR.mu * 0.9 > abs(rates["v_y"] + 30.0 * 0.5) / 5.0


def test_the_step_in_the_core_is_that_of_the_reference():
    problem = rumo.Problem(
        frenet_bicycle(CAR),
        horizon=8,
        sampling_time=0.05,
        track={"n": rumo.Weight(1.0), "velocity_along": rumo.Weight(1.0), "velocity_across": rumo.Weight(1.0)},
        moves={"torque": rumo.Weight(1.0, 1000.0), "steering_rate": rumo.Weight(1.0)},
        constraints={**friction_ellipses(CAR), **slip_limits(CAR)},
        parameters={"curvature": 0.01},
    )
    x = {"s": 3.0, "n": 0.4, "heading_error": -0.02, "v_x": 22.0, "v_y": 0.1, "omega": 0.2, "delta": 0.01}
    wanted = {"n": 0.0, "velocity_along": 25.0, "velocity_across": 0.0}
    plans = [
        rumo.RealTimeIteration(problem, rumo.Radau2(), backend=backend).step(x, wanted)
        for backend in ("portable", "reference")
    ]
    np.testing.assert_allclose(plans[0].u.values, plans[1].u.values, rtol=1e-6, atol=1e-6)
