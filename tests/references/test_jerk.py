"""Speeds with a limit of jerk: closed forms from rest to rest, limits that hold, and nothing given away."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from curves import lobed
from hypothesis import given, settings
from hypothesis import strategies as st

import rumo
from rumo.references import TRACKS, Path, SpeedLimits, speed_profile
from rumo.vehicles import PASSENGER_CAR

LENGTH = 400.0
STRAIGHT = Path([(0.0, 0.0), (LENGTH, 0.0)])
UNLIMITED = SpeedLimits(9.0, 50.0, 50.0, top=200.0)


def jerks(profile):
    """Change of acceleration by time, interval by interval, written out."""
    v, a, gaps = profile.v.tolist(), profile.a.tolist(), np.diff(profile.s).tolist()
    times = [2.0 * gap / (v[i] + v[i + 1]) for i, gap in enumerate(gaps)]
    found = []
    for i in range(len(gaps)):
        if v[i] == 0.0 or (i == 0 and not profile.closed):
            found.append(a[i] / (0.5 * times[i]))
        else:
            found.append((a[i] - a[i - 1]) / (0.5 * (times[i - 1] + times[i])))
        if v[i + 1] == 0.0 or (i + 1 == len(gaps) and not profile.closed):
            found.append(-a[i] / (0.5 * times[i]))
    return np.array(found)


@pytest.mark.parametrize("jerk", [0.5, 1.0, 4.0])
def test_from_rest_to_rest_by_jerk_alone(jerk):
    """+J, -J, +J for a quarter, a half and a quarter of the time: J T^3 / 32 long."""
    profile = speed_profile(STRAIGHT, replace(UNLIMITED, jerk=jerk), start=0.0, end=0.0)
    time = (32.0 * LENGTH / jerk) ** (1.0 / 3.0)
    assert profile.duration == pytest.approx(time, rel=1e-3)
    assert profile.v.max() == pytest.approx(jerk * time**2 / 16.0, rel=1e-3)
    middle = np.abs(profile.t[:-1] - 0.5 * time) < 0.15 * time
    np.testing.assert_allclose(jerks(profile)[:-1][middle], -jerk, rtol=1e-3)


def test_from_rest_to_rest_by_jerk_and_acceleration():
    jerk, most = 1.0, 2.0
    profile = speed_profile(STRAIGHT, replace(UNLIMITED, braking=most, driving=most, jerk=jerk), start=0.0, end=0.0)
    build_up = most / jerk
    v = 0.5 * most * (np.sqrt(build_up**2 + 4.0 * LENGTH / most) - build_up)
    assert profile.duration == pytest.approx(2.0 * (v / most + build_up), rel=1e-3)
    assert profile.v.max() == pytest.approx(v, rel=1e-3)


@st.composite
def cases(draw):
    points = draw(lobed())
    path = Path(points * (60.0 / np.abs(points).max()), closed=True)
    lateral, braking, driving = (draw(st.floats(1.5, 8.0)) for _ in range(3))
    power, drag = draw(st.sampled_from([np.inf, 30.0])), draw(st.sampled_from([0.0, 3e-4]))
    resistance = draw(st.sampled_from([None, (0.0, 0.1, 0.8)]))
    jerk = draw(st.floats(0.3, 20.0))
    return path, SpeedLimits(
        lateral, braking, driving, top=40.0, power=power, drag=drag, resistance=resistance, jerk=jerk
    )


@settings(max_examples=10, deadline=None)
@given(cases(), st.sampled_from([1.0, 0.4]), st.booleans())
def test_all_limits_hold(case, slippery, flying):
    path, limits = case

    def friction(s):
        return np.where(s % path.length < 0.3 * path.length, slippery, 1.0)

    laps = {} if flying else {"laps": 1, "start": 0.0}
    profile = speed_profile(path, limits, friction=friction, spacing=2.0, **laps)
    assert np.abs(jerks(profile)).max() <= limits.jerk * (1.0 + 1e-6)
    assert profile.largest_jerk == pytest.approx(np.abs(jerks(profile)).max(), rel=1e-9)
    kappa, mu, v = np.abs(path.at(profile.s).curvature), friction(profile.s), profile.v
    if flying:
        kappa[-1], mu[-1] = kappa[0], mu[0]
    assert v.max() <= limits.top * (1.0 + 1e-9)
    across = v**2 * kappa / (limits.lateral * mu)
    assert across.max() <= 1.0 + 1e-6
    left = np.sqrt(np.maximum(1.0 - across**2, 0.0)) * mu
    taken = mu**2 * np.interp(across, np.linspace(0.0, 1.0, 3), limits.resistance or (0.0, 0.0, 0.0))
    with np.errstate(divide="ignore"):
        engine = np.minimum(limits.driving * left[:-1], limits.power / v[:-1]) - (limits.drag * v**2 + taken)[:-1]
    assert (profile.a <= engine + 1e-6).all()
    assert (-profile.a <= limits.braking * left[1:] + limits.drag * v[1:] ** 2 + 1e-6).all()
    race = speed_profile(path, replace(limits, jerk=np.inf), friction=friction, spacing=2.0, **laps)
    # To the spacing: where a sweep is at its limit across the path, it leaves nothing for the next interval.
    assert race.duration <= profile.duration * (1.0 + 2e-3)


@settings(max_examples=6, deadline=None)
@given(cases(), st.floats(1.2, 5.0))
def test_more_jerk_is_no_slower_and_enough_of_it_is_none(case, more):
    path, limits = case
    slow, fast, endless = (
        speed_profile(path, replace(limits, jerk=jerk), spacing=2.0).duration
        for jerk in (limits.jerk, more * limits.jerk, 1e5)
    )
    race = speed_profile(path, replace(limits, jerk=np.inf), spacing=2.0).duration
    assert race <= fast * (1.0 + 2e-3)
    assert fast <= slow * (1.0 + 1e-3)
    assert endless == pytest.approx(race, rel=2e-3)


@pytest.mark.parametrize("flying", [True, False])
def test_nothing_is_given_away(flying):
    """IPOPT finds no faster profile within the very same limits, written as they are."""
    track = TRACKS["club"]().path
    limits = SpeedLimits(lateral=4.0, braking=4.0, driving=2.0, top=40.0, jerk=1.5)
    laps = {} if flying else {"laps": 1, "start": 0.0, "end": 0.0}
    profile = speed_profile(track, limits, spacing=15.0, **laps)
    gaps, n = np.diff(profile.s), len(profile.s)
    kappa = np.abs(track.at(profile.s).curvature)
    opti = ca.Opti()
    free = opti.variable(n - 1 if flying else n - 2)
    v = ca.vertcat(free, free[0]) if flying else ca.vertcat(0.0, free, 0.0)
    times, a = 2.0 * gaps / (v[:-1] + v[1:]), (v[1:] ** 2 - v[:-1] ** 2) / (2.0 * gaps)
    across = v**2 * kappa / limits.lateral
    opti.minimize(ca.sum1(times))
    opti.subject_to(opti.bounded(0.05, free, limits.top))
    opti.subject_to(across <= 1.0)
    opti.subject_to((ca.fmax(a, 0.0) / limits.driving) ** 2 + across[:-1] ** 2 <= 1.0)
    opti.subject_to((ca.fmin(a, 0.0) / limits.braking) ** 2 + across[1:] ** 2 <= 1.0)
    after, before = (ca.vertcat(a[1:], a[0]), a) if flying else (a[1:], a[:-1])
    middle = 0.5 * (times + ca.vertcat(times[1:], times[0])) if flying else 0.5 * (times[:-1] + times[1:])
    opti.subject_to(opti.bounded(-limits.jerk, (after - before) / middle, limits.jerk))
    if not flying:
        opti.subject_to(opti.bounded(-limits.jerk, 2.0 * a[0] / times[0], limits.jerk))
        opti.subject_to(opti.bounded(-limits.jerk, 2.0 * a[-1] / times[-1], limits.jerk))
    opti.set_initial(free, 0.9 * profile.v[: n - 1] if flying else 0.9 * profile.v[1:-1])
    opti.solver("ipopt", {"print_time": False}, {"print_level": 0, "max_iter": 500})
    found = opti.solve()
    assert profile.duration == pytest.approx(float(found.value(ca.sum1(times))), rel=1e-3)


def test_a_car_with_what_its_tyres_have_left_and_stops():
    path = Path([(0, 0), (60, 5), (90, 40), (50, 80), (-20, 60), (-30, 20)], closed=True)
    limits = replace(SpeedLimits.of_car(PASSENGER_CAR, 0.5), jerk=2.0)
    profile = speed_profile(path, limits, laps=1, start=0.0, end=0.0, stops=(150.3,), spacing=1.0)
    np.testing.assert_array_equal(profile.speed_at([0.0, 150.3, path.length]), 0.0)
    assert np.abs(jerks(profile)).max() <= 2.0 * (1.0 + 1e-6)
    assert profile.largest_jerk > 1.9


def test_comfort_has_a_jerk_that_can_be_changed():
    assert SpeedLimits.comfort().jerk == 1.0
    assert SpeedLimits.comfort(jerk=np.inf) == SpeedLimits(2.0, 2.0, 1.2, top=36.0)
    for jerk in (0.0, -1.0, np.nan):
        with pytest.raises(rumo.ArgumentError, match=r"jerk: got .*, expected a "):
            SpeedLimits.comfort(jerk=jerk)
