"""What the `AsPrinted` switches restore: the paper's equations, and nothing beside them."""

import casadi as ca
import numpy as np
import pytest
from model_values import derivative

from rumo.vehicles import PAPER_CAR, AsPrinted, LinearTyre, dynamic_bicycle, four_wheel, friction_circles
from rumo.vehicles.parameters import GRAVITY

BODY = ("p_x", "p_y", "psi", "v_x", "v_y", "omega")
PRINTED = AsPrinted(lateral_kinematics=True, drag=True, signed_slip=True, slip_at_center=True)


def random_motion(seed, wheels):
    """A state, inputs and wind in forward driving."""
    rng = np.random.default_rng(seed)
    x = dict(zip(BODY, rng.normal(0.0, [20.0, 3.0, 0.6, 0.0, 0.3, 0.3]), strict=True))
    x["v_x"] = rng.uniform(3.0, 15.0)
    x |= {name: x["v_x"] / PAPER_CAR.r + rng.normal() for name in wheels} | {"delta": rng.uniform(-0.4, 0.4)}
    u = {"torque": rng.uniform(-300.0, 300.0), "steering_rate": rng.uniform(-1.5, 1.5)}
    return x, u, {"wind_speed": rng.uniform(0.0, 5.0), "wind_direction": rng.uniform(-3.0, 3.0)}


def printed_body(x, p, force_x, force_y, moment):
    """Equations (vehicle-dynamics) and (bicycle-dynamics) around their sums of tyre forces."""
    car, psi, v_x, v_y = PAPER_CAR, x["psi"], x["v_x"], x["v_y"]
    wind = p["wind_speed"] * np.exp(1j * (p["wind_direction"] - psi))
    return {
        "p_x": v_x * np.cos(psi) - v_y * np.sin(psi),
        "p_y": v_x * np.sin(psi) - v_y * np.cos(psi),
        "psi": x["omega"],
        "v_x": x["omega"] * v_y + (force_x - car.b_lon * (v_x + wind.real) ** 2) / car.m,
        "v_y": -x["omega"] * v_x + (force_y - car.b_lat * (v_y + wind.imag) ** 2) / car.m,
        "omega": moment / car.I,
    }


def printed_forces(x, wheel, delta, forward):
    """Equations (slip-angle), (slip-ratio), (longitudinal-force) and (lateral-force)."""
    car = PAPER_CAR
    alpha = delta - np.arctan((x["v_y"] + forward * x["omega"]) / x["v_x"])
    return car.front.C_s * (car.r * x[wheel] - x["v_x"]) / x["v_x"], car.front.C_a * alpha


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("switch", "changed"),
    [
        ("lateral_kinematics", {"p_y"}),
        ("drag", {"v_x", "v_y"}),
        ("signed_slip", {"v_x", "v_y", "omega", "w_f", "w_r"}),
        # The rear wheel's plane is the body's: its slips are the same.
        ("slip_at_center", {"v_x", "v_y", "omega", "w_f"}),
        ("full_weight_friction", set()),
    ],
)
def test_switch_changes_only_the_equations_it_names(switch, changed, seed):
    motion = random_motion(seed, ["w_f", "w_r"])
    default = derivative(dynamic_bicycle(PAPER_CAR), *motion)
    printed = derivative(dynamic_bicycle(PAPER_CAR, as_printed=AsPrinted(**{switch: True})), *motion)
    assert {name for name in default if default[name] != printed[name]} == changed


@pytest.mark.parametrize("seed", range(5))
def test_bicycle_is_the_printed_one(seed):
    x, u, p = random_motion(seed, ["w_f", "w_r"])
    car, delta = PAPER_CAR, x["delta"]
    F_xf, F_yf = printed_forces(x, "w_f", delta, car.l_f)
    F_xr, F_yr = printed_forces(x, "w_r", 0.0, -car.l_r)
    across = 2.0 * F_xf * np.sin(delta) + 2.0 * F_yf * np.cos(delta)
    expected = {
        **printed_body(
            x,
            p,
            2.0 * F_xf * np.cos(delta) - 2.0 * F_yf * np.sin(delta) + 2.0 * F_xr,
            across + 2.0 * F_yr,
            across * car.l_f - 2.0 * F_yr * car.l_r,
        ),
        "w_f": -car.r * F_xf / car.J,
        "w_r": (u["torque"] - car.r * F_xr) / car.J,
        "delta": u["steering_rate"],
    }
    # Rounding only; sums of forces may cancel three digits.
    assert derivative(dynamic_bicycle(car, as_printed=PRINTED), x, u, p) == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("seed", range(5))
def test_four_wheel_car_is_the_printed_one(seed):
    x, u, p = random_motion(seed, ["w_fl", "w_fr", "w_rl", "w_rr"])
    car = PAPER_CAR
    radius = car.wheelbase / np.tan(x["delta"])
    left, right = np.arctan(car.wheelbase / (radius - car.t_w)), np.arctan(car.wheelbase / (radius + car.t_w))
    cos_l, sin_l, cos_r, sin_r = np.cos(left), np.sin(left), np.cos(right), np.sin(right)
    F_xfl, F_yfl = printed_forces(x, "w_fl", left, car.l_f)
    F_xfr, F_yfr = printed_forces(x, "w_fr", right, car.l_f)
    F_xrl, F_yrl = printed_forces(x, "w_rl", 0.0, -car.l_r)
    F_xrr, F_yrr = printed_forces(x, "w_rr", 0.0, -car.l_r)
    front_across = F_xfl * sin_l + F_xfr * sin_r + F_yfl * cos_l + F_yfr * cos_r
    front_along = F_xfl * cos_l + F_xfr * cos_r - F_yfl * sin_l - F_yfr * sin_r
    by_track = F_xfr * cos_r - F_xfl * cos_l + F_yfl * sin_l - F_yfr * sin_r - F_xrl + F_xrr
    moment = front_across * car.l_f - (F_yrl + F_yrr) * car.l_r + by_track * car.t_w
    expected = {
        **printed_body(x, p, front_along + F_xrl + F_xrr, front_across + F_yrl + F_yrr, moment),
        "w_fl": -car.r * F_xfl / car.J,
        "w_fr": -car.r * F_xfr / car.J,
        "w_rl": (u["torque"] - car.r * F_xrl) / car.J,
        "w_rr": (u["torque"] - car.r * F_xrr) / car.J,
        "delta": u["steering_rate"],
    }
    assert derivative(four_wheel(car, LinearTyre(), PRINTED), x, u, p) == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("speed", [8.0, 0.0, -3.0])
def test_four_wheel_car_with_slips_at_the_centre_is_finite(speed):
    model = four_wheel(PAPER_CAR, as_printed=AsPrinted(slip_at_center=True))
    for delta in (-0.7, 0.0, 0.7):
        xdot = derivative(model, {"v_x": speed, "v_y": 0.2, "omega": 0.3, "w_fl": 4.0, "delta": delta})
        assert np.isfinite(list(xdot.values())).all()


@pytest.mark.parametrize(
    ("name", "share"),
    [
        ("friction_front", PAPER_CAR.l_r / PAPER_CAR.wheelbase / 2),
        ("friction_rear", PAPER_CAR.l_f / PAPER_CAR.wheelbase / 2),
    ],
)
def test_full_weight_allows_one_tyre_the_friction_of_the_whole_car(name, share):
    def used(as_printed):
        model = dynamic_bicycle(PAPER_CAR)
        constraint = friction_circles(PAPER_CAR, as_printed=as_printed)[name]
        row = model.scalar(constraint.expression(*model.symbols), name)
        x = {"v_x": 8.0, "v_y": 0.01, "omega": 0.02, "w_f": 13.35, "w_r": 13.34, "delta": 0.01}
        function = ca.Function("row", [model.x, model.p], [row])
        return float(function(model.states.vector(x, "x", np.zeros(9)), model.default_parameters)) + 1.0

    assert used(AsPrinted(full_weight_friction=True)) == pytest.approx(share**2 * used(None))


def test_static_loads_of_the_paper_car():
    # One front tyre carries 545 N, one rear tyre 436 N.
    assert PAPER_CAR.front_load == pytest.approx(545.0)
    assert PAPER_CAR.rear_load == pytest.approx(436.0)
    assert 2.0 * (PAPER_CAR.front_load + PAPER_CAR.rear_load) == pytest.approx(PAPER_CAR.m * GRAVITY)
