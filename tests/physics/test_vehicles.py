"""Cars by name: the numbers of their sources, loads and sizes that fit together; and cars in files."""

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from model_values import derivative, jacobian

import rumo
from rumo.vehicles import (
    PAPER_CAR,
    PASSENGER_CAR,
    RACER_1_10,
    TYRE_235_60_R16,
    VEHICLES,
    VehicleLimits,
    VehicleParameters,
    dynamic_bicycle,
    four_wheel,
)
from rumo.vehicles.parameters import GRAVITY

every_car = pytest.mark.parametrize("name", VEHICLES)


@every_car
def test_a_car_is_as_long_and_wide_as_its_wheels_and_rolls_without_force(name):
    car = VEHICLES[name]
    assert car.length >= car.wheelbase
    assert car.width >= 2.0 * car.t_w
    still = replace(car, b_lon=0.0, b_lat=0.0)
    wheels = ("w_f", "w_r", "w_fl", "w_fr", "w_rl", "w_rr")
    for model in (dynamic_bicycle(still), four_wheel(still)):
        x = {"v_x": 3.0} | {wheel: 3.0 / car.r for wheel in wheels if wheel in model.states}
        assert derivative(model, x) == pytest.approx({**dict.fromkeys(model.states, 0.0), "p_x": 3.0}, abs=1e-9)
        assert np.isfinite(jacobian(model, {})).all()


@every_car
def test_motor_and_brakes_ask_for_no_more_than_the_motor_has(name):
    limits = VEHICLES[name].limits
    assert 0.2 < limits.steering_angle < 0.5 * np.pi
    assert limits.acceleration <= limits.braking
    assert limits.power <= VEHICLES[name].m * limits.acceleration * limits.speed


def test_the_paper_bounds_are_300_newton_metres_a_wheel():
    limits = PAPER_CAR.limits
    torque = 0.5 * PAPER_CAR.m * PAPER_CAR.r * np.array([limits.acceleration, limits.braking])
    np.testing.assert_allclose(torque, 300.0)
    assert (np.rad2deg(limits.steering_angle), limits.steering_rate) == pytest.approx((45.0, 1.5))


@pytest.mark.parametrize(("name", "number"), [("commonroad-1", 1), ("passenger", 2), ("commonroad-3", 3)])
def test_commonroad_says_the_same(name, number):
    module = pytest.importorskip(f"vehiclemodels.parameters_vehicle{number}")
    theirs, ours = getattr(module, f"parameters_vehicle{number}")(), VEHICLES[name]
    assert (ours.m, ours.I, ours.l_f, ours.l_r) == (theirs.m, theirs.I_z, theirs.a, pytest.approx(theirs.b))
    assert (ours.r, ours.J, ours.h) == (theirs.R_w, theirs.I_y_w, pytest.approx(theirs.h_cg))
    assert (ours.length, ours.width) == (theirs.l, theirs.w)
    assert 4.0 * ours.t_w == pytest.approx(theirs.T_f + theirs.T_r)
    drive, steer = theirs.longitudinal, theirs.steering
    assert asdict(ours.limits) == pytest.approx(
        {
            "steering_angle": steer.max,
            "steering_rate": steer.v_max,
            "acceleration": drive.a_max,
            "braking": drive.a_max,
            "speed": drive.v_max,
            "power": theirs.m * drive.a_max * drive.v_switch,
            "lateral": np.inf,
        }
    )
    tyre = {name.lower(): value for name, value in vars(ours.front.magic_formula).items()}
    for key in ("p_cx1", "p_dx1", "p_ex1", "p_kx1", "p_cy1", "p_dy1", "p_ey1", "r_bx1", "r_bx2", "r_cx1", "r_ex1"):
        assert tyre[key] == getattr(theirs.tire, key)
    for key in ("r_by1", "r_by2", "r_cy1", "r_ey1"):
        assert tyre[key] == getattr(theirs.tire, key)
    assert tyre["p_ky1"] == -theirs.tire.p_ky1


def test_the_racer_turns_as_in_its_gym():
    """Yaw acceleration by sideslip and yaw rate as CommonRoad's single-track model writes it, which the gym takes."""
    mu, C_Sf, C_Sr, l_f, l_r, m, I, v = 1.0489, 4.718, 5.4562, 0.15875, 0.17145, 3.74, 0.04712, 5.0  # noqa: E741
    front, rear = C_Sf * GRAVITY * l_r, C_Sr * GRAVITY * l_f
    by_sideslip = mu * m / (I * (l_f + l_r)) * (l_r * rear - l_f * front)
    by_rate = -mu * m / (I * (l_f + l_r)) * (l_f**2 * front + l_r**2 * rear) / v
    by_steering = mu * m / (I * (l_f + l_r)) * l_f * front
    model = dynamic_bicycle(RACER_1_10)
    J, at = jacobian(model, {"v_x": v, "w_f": v / RACER_1_10.r, "w_r": v / RACER_1_10.r}), model.states.index
    ours = [J[at("omega"), at("v_y")] * v, J[at("omega"), at("omega")], J[at("omega"), at("delta")]]
    # Slips are smoothed below 0.1 m/s: 1 in 2500 at 5 m/s, at most 2e-4 of its root.
    np.testing.assert_allclose(ours, [by_sideslip, by_rate, by_steering], rtol=4e-4)


@every_car
def test_a_car_comes_back_from_its_file(name, tmp_path):
    VEHICLES[name].to_toml(tmp_path / "car.toml")
    assert VehicleParameters.from_toml(tmp_path / "car.toml") == VEHICLES[name]


@given(
    m=st.floats(1e-3, 1e6),
    mu=st.floats(0.01, 3.0),
    h=st.floats(0.0, 3.0),
    change=st.floats(-0.5, 0.5),
    speed=st.one_of(st.just(np.inf), st.floats(0.1, 100.0)),
)
@settings(deadline=None, max_examples=50)
def test_every_number_comes_back_as_it_was(tmp_path_factory, m, mu, h, change, speed):
    coefficients = replace(TYRE_235_60_R16, p_Dy2=change)
    front = replace(PASSENGER_CAR.front, mu=mu, magic_formula=coefficients)
    rear = replace(PASSENGER_CAR.rear, magic_formula=None)
    car = replace(PASSENGER_CAR, m=m, h=h, front=front, rear=rear, limits=VehicleLimits(speed=speed))
    path = tmp_path_factory.mktemp("cars") / "car.toml"
    car.to_toml(path)
    assert VehicleParameters.from_toml(path) == car


SMALL = """
m = 200
I = 150
l_f = 0.8
l_r = 1.0
t_w = 0.6
r = 0.6
J = 0.2
b_lon = 0.01
b_lat = 0.05

[front]
C_s = 6e5
C_a = 2.5e5
mu = 0.9

[rear]
C_s = 6e5
C_a = 2.5e5
mu = 0.9
"""


def written(tmp_path, text):
    path = tmp_path / "car.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_what_may_be_left_out_has_its_default(tmp_path):
    car = VehicleParameters.from_toml(written(tmp_path, SMALL))
    assert car == replace(PAPER_CAR, limits=VehicleLimits())
    assert (car.length, car.width) == (3.0, 1.2)
    assert VehicleParameters.from_toml(str(tmp_path / "car.toml")) == car


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("m = 200", "mas = 200"), r"car.toml: mas: got 'mas', expected one of m, I, .*"),
        (("C_a = 2.5e5", "Ca = 2.5e5"), r"car.toml: front.Ca: got 'Ca', .*Did you mean 'C_a'\?"),
        (("mu = 0.9", ""), r"car.toml: front.mu: got nothing, expected all of C_s, C_a, mu. Add the missing"),
        (("l_f = 0.8", ""), r"car.toml: l_f: got nothing, expected all of m, I, l_f, "),
        (("mu = 0.9", "mu = -0.9"), r"car.toml: front.mu: got -0.9, expected a positive finite number"),
        (("mu = 0.9", "mu = '0.9'"), r"car.toml: front.mu: got '0.9', expected a positive number"),
        (("m = 200", "m = true"), r"car.toml: m: got True, expected a positive number"),
        (("m = 200", "m = 200\nfront = 1.0"), r"car.toml: got .*expected a TOML file"),
        (("[front]", "[limits]\npower = 0.0\n[front]"), r"car.toml: limits.power: got 0.0, expected a positive finite"),
        (("m = 200", "m = 200\nlimits = 3"), r"car.toml: limits: got 3, expected a table. Write \[limits\]"),
        (("m = 200", "m = 200 kg"), r"car.toml: got .*line 2.*expected a TOML file with lines such as m = 1093.3"),
        (
            ("mu = 0.9", "mu = 0.9\n[front.magic_formula]\np_Cx1 = 3.0"),
            r"car.toml: front.magic_formula.p_Dx1: got nothing, expected all of p_Cx1, ",
        ),
    ],
)
def test_a_file_that_is_wrong_names_itself_and_the_key(tmp_path, change, message):
    path = written(tmp_path, SMALL.replace(*change, 1))
    with pytest.raises(rumo.ArgumentError, match=message) as caught:
        VehicleParameters.from_toml(path)
    assert str(caught.value).startswith(str(path))


def test_a_coefficient_that_is_wrong_is_named_with_its_tyre(tmp_path):
    PASSENGER_CAR.to_toml(tmp_path / "car.toml")
    text = (tmp_path / "car.toml").read_text().replace("p_Cx1 = 1.6411", "p_Cx1 = 3.0")
    with pytest.raises(rumo.ArgumentError, match=r"front.magic_formula.p_Cx1: got 3.0, expected at most 2"):
        VehicleParameters.from_toml(written(tmp_path, text))


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(FileNotFoundError):
        VehicleParameters.from_toml(tmp_path / "none.toml")
    with pytest.raises(OSError, match="none"):
        PAPER_CAR.to_toml(Path(tmp_path / "none" / "car.toml"))
    (tmp_path / "bytes.toml").write_bytes(b"m = \xff")
    with pytest.raises(rumo.ArgumentError, match="expected a TOML file"):
        VehicleParameters.from_toml(tmp_path / "bytes.toml")


def test_sizes_follow_the_wheels_where_none_are_given():
    car = replace(PAPER_CAR, t_w=0.7, width=0.0, length=0.0)
    assert (car.length, car.width) == (pytest.approx(0.8 + 1.0 + 1.2), pytest.approx(1.4))
    with pytest.raises(rumo.ArgumentError, match=r"VehicleParameters.limits: got 3.0, expected a rumo.VehicleLimits"):
        replace(PAPER_CAR, limits=3.0)
    with pytest.raises(rumo.ArgumentError, match=r"VehicleLimits.speed: got -1.0, expected a positive"):
        VehicleLimits(speed=-1.0)
