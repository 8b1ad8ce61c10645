"""What holds for every tyre model, from the motion of its wheel on: any speed, zero and reverse included."""

from dataclasses import replace
from functools import cache

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rumo.vehicles import (
    PAPER_CAR,
    PASSENGER_CAR,
    RACER_1_10,
    TYRE_235_60_R16,
    Dugoff,
    LinearTyre,
    MagicFormula,
    ModifiedDugoff,
    SaturatingTyre,
)
from rumo.vehicles.tyres import slip

# Model, car, largest force over mu F_z: of the modified Dugoff tyre its constants, beyond which its factors never are;
# of the magic formula what it reaches with both slips, on a fine grid: 1.178, and 1.309 at the lightest load.
CASES = {
    "linear": (LinearTyre(), PASSENGER_CAR, np.inf),
    "saturating": (SaturatingTyre(), PASSENGER_CAR, 1.0),
    "saturating-paper": (SaturatingTyre(), PAPER_CAR, 1.0),
    "dugoff": (Dugoff(), PASSENGER_CAR, 1.0),
    "dugoff-paper": (Dugoff(), PAPER_CAR, 1.0),
    "dugoff-racer": (Dugoff(), RACER_1_10, 1.0),
    "modified": (ModifiedDugoff(), PASSENGER_CAR, 1.27),
    "modified-paper": (ModifiedDugoff(), PAPER_CAR, 1.27),
    "magic": (MagicFormula(), PASSENGER_CAR, 1.18),
    "magic-load": (
        MagicFormula(),
        replace(PASSENGER_CAR, front=replace(PASSENGER_CAR.front, magic_formula=TYRE_235_60_R16)),
        1.31,
    ),
}
every_tyre = pytest.mark.parametrize("case", CASES)
VELOCITY = st.one_of(st.just(0.0), st.floats(-0.5, 0.5), st.floats(-40.0, 40.0))
WHEEL = st.fixed_dictionaries(
    {
        "v_lon": VELOCITY,
        "v_lat": VELOCITY,
        "rim": VELOCITY,  # speed of the tread, r times the wheel's
        "load": st.floats(0.02, 4.0),  # over the static load
        "mu": st.floats(0.05, 1.3),
    }
)


@cache
def wheel(case):
    """Functions of (v_lon, v_lat, w), load and mu: the force, and its Jacobian by the motion."""
    model, car, _ = CASES[case]
    motion, load, mu = ca.SX.sym("motion", 3), ca.SX.sym("load"), ca.SX.sym("mu")
    sigma, tan_alpha, direction = slip(motion[0], motion[1], motion[2], car.r)
    F = ca.vertcat(*model.force(car.front, sigma, tan_alpha, load, mu, direction))
    given_ = [motion, load, mu]
    return ca.Function("F", given_, [F]), ca.Function("J", given_, [ca.jacobian(F, motion)])


def force_and_slope(case, at, mirrored=False):
    car = CASES[case][1]
    motion = np.array([at["v_lon"], -at["v_lat"] if mirrored else at["v_lat"], at["rim"] / car.r])
    given_ = motion, at["load"] * car.front_load, at["mu"]
    return motion, *(function(*given_).full() for function in wheel(case))


@every_tyre
@given(at=WHEEL)
@settings(deadline=None, max_examples=80)
def test_forces_and_slopes_are_finite_and_oppose_the_sliding(case, at):
    _, car, factor = CASES[case]
    _, F, J = force_and_slope(case, at)
    assert np.isfinite(F).all()
    assert np.isfinite(J).all()
    limit = factor * at["mu"] * at["load"] * car.front_load
    assert np.hypot(*F.ravel()) <= limit * (1.0 + 1e-9)
    # The tread slides over the ground with the velocity of the wheel's centre less that of its rim.
    small = 1e-9 * (limit if np.isfinite(limit) else np.abs(F).max())
    assert F[0, 0] * (at["v_lon"] - at["rim"]) <= small
    assert F[1, 0] * at["v_lat"] <= small


@every_tyre
@given(at=WHEEL)
@settings(deadline=None, max_examples=40)
def test_left_is_the_mirror_image_of_right(case, at):
    _, F, _ = force_and_slope(case, at)
    _, mirrored, _ = force_and_slope(case, at, mirrored=True)
    np.testing.assert_array_equal(mirrored.ravel(), [F[0, 0], -F[1, 0]])


@every_tyre
@given(at=WHEEL, angle=st.floats(0.0, 6.28), up=st.floats(-1.0, 1.0))
@settings(deadline=None, max_examples=40)
def test_forces_are_continuous(case, at, angle, up):
    """A short way off, the force differs by what its slopes on the way make of the way."""
    F, J = wheel(case)
    motion, here, _ = force_and_slope(case, at)
    given_ = CASES[case][1].front_load * at["load"], at["mu"]
    way = 1e-4 * np.array([np.cos(angle), np.sin(angle), up])
    points = [motion + share * way for share in np.linspace(0.0, 1.0, 201)]
    steepest = max(np.abs(J(point, *given_).full() @ way).max() for point in points)
    there = F(points[-1], *given_).full()
    # Slopes may jump at kinks; values may not.
    assert np.abs(there - here).max() <= 1.05 * steepest + 1e-9 * np.abs(here).max()
