"""Bicycle: stiffness in straight running, signs from standstill to reverse, drag, derivatives."""

import numpy as np
import pytest
from model_values import central_differences, derivative, jacobian

from rumo.vehicles import PAPER_CAR, PASSENGER_CAR, RearTorque, dynamic_bicycle

CARS = {"paper": PAPER_CAR, "passenger": PASSENGER_CAR}
both_cars = pytest.mark.parametrize("car", CARS.values(), ids=CARS.keys())

STATES = {
    "standstill": {},
    "standstill_steered": {"delta": 0.5, "psi": 1.0},
    "creeping": {"v_x": 0.05, "w_f": 0.1, "w_r": 0.1, "delta": 0.2},
    "cornering": {"v_x": 8.0, "v_y": 0.3, "omega": 0.4, "w_f": 13.4, "w_r": 13.5, "delta": 0.1, "psi": 0.7, "p_y": 2.0},
    "reverse": {"v_x": -3.0, "v_y": 0.1, "omega": -0.2, "w_f": -5.0, "w_r": -5.1, "delta": -0.3},
    "sideways": {"v_y": 4.0, "psi": -2.0},
    "spinning_wheels": {"w_r": 50.0},
}
every_state = pytest.mark.parametrize("x", STATES.values(), ids=STATES.keys())


def rolling(car, speed, **others):
    """Straight running with wheels that roll."""
    return {"v_x": speed, "w_f": speed / car.r, "w_r": speed / car.r, **others}


def eigenvalues(car, speed):
    """Nonzero eigenvalues of df/dx in straight running, fastest first; v_x itself decays by drag alone."""
    values = np.linalg.eigvals(jacobian(dynamic_bicycle(car), rolling(car, speed)))
    return sorted(value for value in values if abs(value) > 1.0)


# Wheels, then lateral motion and yaw [1/s], with the paper's parameters.
@pytest.mark.parametrize(
    ("speed", "expected"),
    [
        (2.0, [-546_000, -540_000, -2927, -2306]),
        (5.0, [-218_400, -216_000, -1169, -925]),
        (10.0, [-109_200, -108_000, -580, -467]),
        (15.0, [-72_800, -72_000, -381, -316]),
    ],
)
def test_eigenvalues_of_the_paper_car(speed, expected):
    # The table's last digits, and sqrt(v^2 + eps^2) in place of v, which is 0.13 % at 2 m/s.
    np.testing.assert_allclose(eigenvalues(PAPER_CAR, speed), expected, rtol=0.01)


@pytest.mark.parametrize("speed", [2.0, 15.0])
def test_wheel_modes_in_closed_form(speed):
    car = PAPER_CAR
    # -C_s r^2 / (J v) where front and rear wheels turn against each other and the body stays at rest; where they
    # turn together they push the mass m by four tyres, which adds -4 C_s / (m v). The smoothed v is exact for wheels.
    smoothed = np.hypot(speed, 0.1)
    wheel, body = -car.front.C_s * car.r**2 / (car.J * smoothed), -4.0 * car.front.C_s / (car.m * smoothed)
    together, apart = eigenvalues(car, speed)[:2]
    # The body's own slip has the plain v: up to 0.25 % of a hundredth of the eigenvalue at 2 m/s.
    assert apart == pytest.approx(wheel, rel=1e-4)
    assert together == pytest.approx(wheel + body, rel=1e-4)


@both_cars
@pytest.mark.parametrize("speed", [5.0, 15.0])
def test_lateral_modes_are_those_of_the_single_track_model(car, speed):
    f, r = 2.0 * car.front.C_a, 2.0 * car.rear.C_a
    coupling = (r * car.l_r - f * car.l_f) / speed
    A = np.array(
        [
            [-(f + r) / (car.m * speed), coupling / car.m - speed],
            [coupling / car.I, -(f * car.l_f**2 + r * car.l_r**2) / (car.I * speed)],
        ]
    )
    x = rolling(car, speed)
    model = dynamic_bicycle(car)
    rows = [model.states.index(name) for name in ("v_y", "omega")]
    # eps^2 / v^2 of the smoothed denominator is 0.04 % at 5 m/s. The passenger car steers neutrally: a zero remains.
    np.testing.assert_allclose(jacobian(model, x)[np.ix_(rows, rows)], A, rtol=1e-3, atol=1e-9)


@both_cars
def test_rolling_straight_only_drag_brakes(car):
    xdot = derivative(dynamic_bicycle(car), rolling(car, 10.0))
    assert xdot["p_x"] == 10.0
    assert xdot["v_x"] == pytest.approx(-car.b_lon * 100.0 / car.m, rel=1e-9)
    for name in ("p_y", "psi", "v_y", "omega", "delta"):
        assert xdot[name] == 0.0
    # r * (v / r) may differ from v by a rounding error, 1e-16, times C_s r / J.
    assert abs(xdot["w_f"]) < 1e-8
    assert abs(xdot["w_r"]) < 1e-8


@both_cars
def test_standstill_is_an_equilibrium(car):
    assert all(value == 0.0 for value in derivative(dynamic_bicycle(car), {"delta": 0.3, "psi": 1.0}).values())


@both_cars
@every_state
def test_dynamics_and_derivatives_are_finite(car, x):
    model = dynamic_bicycle(car)
    assert np.isfinite(list(derivative(model, x).values())).all()
    assert np.isfinite(jacobian(model, x)).all()


@both_cars
@pytest.mark.parametrize(("speed", "turns"), [(5.0, 1.0), (0.5, 1.0), (-0.5, -1.0), (-5.0, -1.0)])
def test_steering_left_turns_left_forwards_and_right_in_reverse(car, speed, turns):
    # Kinematically omega = v tan(delta) / L.
    xdot = derivative(dynamic_bicycle(car), rolling(car, speed, delta=0.2))
    assert xdot["omega"] * turns > 0.0


@both_cars
@pytest.mark.parametrize("speed", [5.0, -5.0])
def test_side_slip_is_damped_forwards_and_in_reverse(car, speed):
    slope = jacobian(dynamic_bicycle(car), rolling(car, speed))
    names = list(dynamic_bicycle(car).states)
    for name in ("v_y", "omega", "w_f", "w_r"):
        assert slope[names.index(name), names.index(name)] < 0.0


@both_cars
@pytest.mark.parametrize("speed", [5.0, 0.0, -5.0])
def test_torque_pushes_forwards_at_any_speed(car, speed):
    model = dynamic_bicycle(car)
    assert derivative(model, rolling(car, speed), {"torque": 100.0})["w_r"] == pytest.approx(100.0 / car.J)
    spinning = rolling(car, speed) | {"w_r": speed / car.r + 0.1}
    assert derivative(model, spinning)["v_x"] > derivative(model, rolling(car, speed))["v_x"]


@both_cars
@pytest.mark.parametrize("psi", [0.0, 2.0, -1.0])
@pytest.mark.parametrize(
    ("speed", "wind_along", "sign"),
    [
        (10.0, 0.0, -1),
        (10.0, -5.0, -1),
        (10.0, 9.0, -1),
        (10.0, 15.0, 1),
        (0.0, 5.0, 1),
        (-5.0, 0.0, 1),
        (-5.0, -9.0, -1),
    ],
)
def test_drag_opposes_the_relative_wind(car, psi, speed, wind_along, sign):
    wind = {"wind_speed": wind_along, "wind_direction": psi}
    xdot = derivative(dynamic_bicycle(car), rolling(car, speed, psi=psi), p=wind)
    # Rolling wheels carry no force but rounding times C_s / m, 1e-12 at most.
    assert xdot["v_x"] == pytest.approx(sign * car.b_lon * (speed - wind_along) ** 2 / car.m, rel=1e-6)
    assert xdot["v_y"] == pytest.approx(0.0, abs=1e-9)


@both_cars
@pytest.mark.parametrize("psi", [0.0, 2.5])
def test_side_wind_pushes_to_where_it_blows(car, psi):
    wind = {"wind_speed": 10.0, "wind_direction": psi + np.pi / 2.0}
    xdot = derivative(dynamic_bicycle(car), {"psi": psi}, p=wind)
    assert xdot["v_y"] == pytest.approx(car.b_lat * 100.0 / car.m)
    assert xdot["v_x"] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("psi", [0.0, 1.0, 3.0, -2.0])
def test_position_follows_the_velocity_over_ground(psi):
    xdot = derivative(dynamic_bicycle(PAPER_CAR), {"psi": psi, "v_x": 3.0, "v_y": -0.5})
    velocity = (3.0 - 0.5j) * np.exp(1j * psi)
    assert xdot["p_x"] + 1j * xdot["p_y"] == pytest.approx(velocity)


def test_axle_torque_is_shared_by_two_wheels():
    x = STATES["cornering"]
    whole = derivative(dynamic_bicycle(PAPER_CAR, drive=RearTorque(axle=True)), x, {"torque": 200.0})
    assert whole == derivative(dynamic_bicycle(PAPER_CAR), x, {"torque": 100.0})


@both_cars
@every_state
def test_derivatives_against_finite_differences(car, x):
    model = dynamic_bicycle(car)
    u, p = {"torque": 50.0, "steering_rate": 0.3}, {"wind_speed": 3.0, "wind_direction": 0.5}
    exact, estimate = jacobian(model, x, u, p), central_differences(model, x, u, p)
    # Rows differ by six orders of magnitude: each is measured by its largest entry. The slips vary over 0.1 m/s,
    # so steps of 1e-5 leave (1e-5 / 0.1)^2 = 1e-8 by curvature.
    size = np.maximum(np.abs(exact).max(axis=1, keepdims=True), 1e-6)
    assert np.max(np.abs(exact - estimate) / size) < 1e-5
