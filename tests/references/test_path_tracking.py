"""Paths by place: progress through crossings and laps, headings next to the vehicle's, signals the problem knows."""

from functools import cache

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rumo
from rumo.references import TRACKS, Path, PathTracking, SpeedLimits, SpeedProfile, deviations, speed_profile
from rumo.signals import NamedArray, Signals
from rumo.vehicles import PASSENGER_CAR, dynamic_bicycle

LIMITS = SpeedLimits(lateral=4.0, braking=3.0, driving=2.0, top=15.0)
EIGHT = TRACKS["eight"]().path
EIGHT_PROFILE = speed_profile(EIGHT, LIMITS)
TIMES = 0.05 * np.arange(21)
STATES = Signals({"p_x": "m", "p_y": "m", "psi": "rad"}, "states")


def at(path, s, aside=0.0, turned=0.0):
    """A vehicle beside a path, along it but for an angle."""
    heading = float(path.at(s).heading)
    return NamedArray(STATES, np.array([*path.offset(s, aside), heading + turned]))


@settings(max_examples=20, deadline=None)
@given(st.floats(0.0, 1.0), st.floats(0.3, 1.6), st.integers(0, 2**32 - 1))
def test_progress_is_the_vehicles_whatever_the_clock_says(begin, pace, seed):
    """Laps through a crossing, slower or faster than the profile, with lateral errors up to 2 m."""
    rng, running = np.random.default_rng(seed), PathTracking(EIGHT, EIGHT_PROFILE).start()
    s, now = (0.02 + 0.46 * begin) * EIGHT.length, 0.0
    for _ in range(150):
        running.preview(now + TIMES, at(EIGHT, s, rng.uniform(-2.0, 2.0)))
        assert running.progress == pytest.approx(s, abs=1e-6)
        step = rng.uniform(0.05, 0.15)
        s, now = s + pace * float(EIGHT_PROFILE.speed_at(s)) * step, now + step
    assert running.lap == s // EIGHT.length or s % EIGHT.length < 3.0


def test_what_lies_ahead_is_the_profile_from_here_on():
    s = 37.0
    signals = (
        PathTracking(EIGHT, EIGHT_PROFILE, outputs=("p_x", "p_y", "speed", "course", "omega"))
        .preview(3.0 + TIMES, at(EIGHT, s, 1.0))
        .signals
    )
    # Progress by Euler's method with a thousand steps to each of the horizon's.
    places = [s]
    for _ in range(1000 * (len(TIMES) - 1)):
        places.append(places[-1] + 5e-5 * float(EIGHT_PROFILE.speed_at(places[-1] + 0.5 * 5e-5 * 10.0)))
    there = EIGHT.at(places[::1000])
    np.testing.assert_allclose(signals["p_x"], there.x, atol=1e-2)
    np.testing.assert_allclose(signals["p_y"], there.y, atol=1e-2)
    np.testing.assert_allclose(signals["course"], there.heading, atol=1e-3)
    np.testing.assert_allclose(signals["speed"], EIGHT_PROFILE.speed_at(places[::1000]), atol=1e-2)
    np.testing.assert_allclose(signals["omega"], signals["speed"] * there.curvature, atol=2e-2)


def test_headings_are_continuous_over_laps_and_next_to_the_vehicles():
    oval = TRACKS["oval"]().path
    profile = speed_profile(oval, LIMITS)
    for turns, wrapped in ((0, False), (2, False), (0, True)):
        running, headings = PathTracking(oval, profile).start(), []
        for k, s in enumerate(np.arange(10.0, 2.5 * oval.length, 2.0)):
            x = at(oval, s, turned=2.0 * np.pi * turns + 0.1)
            if wrapped:
                x.values[2] = (x.values[2] + np.pi) % (2.0 * np.pi) - np.pi
            headings.append(running.preview(0.2 * k + TIMES, x).signals["psi"][0])
        assert np.abs(np.diff(headings)).max() < 0.1
        assert headings[-1] - headings[0] == pytest.approx(5.0 * np.pi, abs=0.2)
        assert headings[0] == pytest.approx(2.0 * np.pi * turns, abs=1e-6)


def test_a_car_that_has_spun_is_not_turned_back():
    running = PathTracking(EIGHT, EIGHT_PROFILE).start()
    for k, turned in enumerate(np.linspace(0.0, 2.0 * np.pi, 30)):
        psi = running.preview(0.05 * k + TIMES, at(EIGHT, 10.0, turned=turned)).signals["psi"]
    assert psi[0] == pytest.approx(float(EIGHT.at(10.0).heading) + 2.0 * np.pi)


def test_a_lost_position_is_as_it_was():
    running = PathTracking(EIGHT, EIGHT_PROFILE).start()
    before = running.preview(TIMES, at(EIGHT, 20.0))
    lost = running.preview(TIMES, NamedArray(STATES, np.full(3, np.nan)))
    np.testing.assert_array_equal(lost.signals["p_x"], before.signals["p_x"])
    never = PathTracking(EIGHT, EIGHT_PROFILE).preview(TIMES, NamedArray(STATES, np.full(3, np.nan)))
    assert np.isnan(never.signals["p_x"]).all()


def test_each_run_begins_for_itself():
    tracking = PathTracking(EIGHT, EIGHT_PROFILE)
    first, second = tracking.start(), tracking.start()
    first.preview(TIMES, at(EIGHT, 0.25 * EIGHT.length))
    second.preview(TIMES, at(EIGHT, 0.75 * EIGHT.length))
    assert first.progress == pytest.approx(0.25 * EIGHT.length)
    assert second.progress == pytest.approx(0.75 * EIGHT.length)
    # A run that is begun again from the start looks everywhere again.
    second.preview(TIMES - 1.0, at(EIGHT, 0.25 * EIGHT.length))
    assert second.progress == pytest.approx(0.25 * EIGHT.length)
    begins = PathTracking(EIGHT, EIGHT_PROFILE, begin=0.5 * EIGHT.length).start()
    begins.preview(TIMES, at(EIGHT, 0.0))
    assert begins.progress == pytest.approx(0.5 * EIGHT.length)


def test_a_standing_start_behind_the_line():
    profile = speed_profile(EIGHT, LIMITS, laps=1, start=0.0, end=0.0)
    running = PathTracking(EIGHT, profile).start()
    signals = running.preview(TIMES, at(EIGHT, EIGHT.length - 0.01)).signals
    assert running.progress == pytest.approx(-0.01)
    assert running.lap == -1
    along = np.hypot(signals["p_x"] - signals["p_x"][0], signals["p_y"] - signals["p_y"][0])
    np.testing.assert_allclose(along[1:], 0.5 * 2.0 * TIMES[1:] ** 2, rtol=1e-3)


@pytest.mark.parametrize("v", [0.0, 3.0, 12.0])
def test_a_slow_car_is_not_asked_to_be_where_it_cannot_get_to(v):
    """By an integration of its own: as fast as an acceleration allows, but never faster than the profile."""
    states = Signals({"p_x": "m", "p_y": "m", "v_x": "m/s"}, "states")
    s = 0.3 * EIGHT.length
    tracking = PathTracking(EIGHT, EIGHT_PROFILE, outputs=("p_x", "p_y", "speed"), acceleration=4.0)
    signals = tracking.preview(TIMES, NamedArray(states, np.r_[EIGHT.offset(s, 0.0), v])).signals
    place, speed, step, places, speeds = s, min(v, float(EIGHT_PROFILE.speed_at(s))), 1e-3, [s], []
    for k in range(50 * (len(TIMES) - 1)):
        if k % 50 == 0:
            speeds.append(speed)
        place += step * speed
        speed = min(speed + 4.0 * step, float(EIGHT_PROFILE.speed_at(place)))
        if k % 50 == 49:
            places.append(place)
    there = EIGHT.at(places)
    np.testing.assert_allclose(signals["p_x"], there.x, atol=0.1)
    np.testing.assert_allclose(signals["p_y"], there.y, atol=0.1)
    np.testing.assert_allclose(signals["speed"][:-1], speeds, atol=0.2)


def kinematic(parameters=None, outputs=None):
    return rumo.Model(
        states={"p_x": "m", "p_y": "m", "psi": "rad", "v_x": "m/s"},
        inputs={"a": "m/s^2", "bend": "1/m"},
        dynamics=lambda x, u, p: {
            "p_x": x.v_x * ca.cos(x.psi),
            "p_y": x.v_x * ca.sin(x.psi),
            "psi": x.v_x * u.bend,
            "v_x": u.a,
        },
        parameters=parameters or {},
        outputs=outputs or {},
        name="kinematic",
    )


@cache
def controller(parameters=()):
    model = kinematic(
        {name: rumo.Parameter("1/m", 0.0) for name in parameters},
        {"course": rumo.Output("rad", lambda x, u, p: x.psi)},
    )
    W = rumo.Weight
    problem = rumo.Problem(
        model,
        horizon=20,
        sampling_time=0.1,
        track={"p_x": W(10.0), "p_y": W(10.0), "course": W(5.0), "v_x": W(1.0)},
        moves={"a": W(0.1, range=4.0), "bend": W(0.1, range=0.2)},
        bounds={"a": (-5.0, 4.0), "bend": (-0.1, 0.1)},
    )
    return rumo.RealTimeIteration(problem, rumo.Radau2())


def test_signals_and_parameters_are_those_the_problem_knows():
    problem = controller(("curvature", "mu")).problem
    tracking = PathTracking(
        EIGHT, EIGHT_PROFILE, PASSENGER_CAR, parameters={"mu": lambda s: np.where(s < 45.0, 0.9, 0.3)}
    )
    x = NamedArray(problem.model.states, np.array([*EIGHT.offset(40.0, 0.0), 0.0, 5.0]))
    preview = tracking.start(problem).preview(problem.times, x)
    assert set(preview.signals) == {"p_x", "p_y", "psi", "course", "v_x"}
    s = np.array(
        [tracking.path.project((px, py)) for px, py in zip(preview.signals["p_x"], preview.signals["p_y"], strict=True)]
    )
    middle = 0.5 * (s[1:] + s[:-1])
    np.testing.assert_allclose(preview.parameters["curvature"], EIGHT.at(middle).curvature, atol=1e-6)
    np.testing.assert_array_equal(preview.parameters["mu"], np.where(middle < 45.0, 0.9, 0.3))
    assert len(preview.parameters["mu"]) == problem.horizon
    # Without a problem, what the state has; with a vehicle, what it knows of rolling.
    bicycle = dynamic_bicycle(PASSENGER_CAR).states
    x = NamedArray(bicycle, np.r_[EIGHT.offset(40.0, 0.0), np.zeros(7)])
    assert set(tracking.preview(problem.times, x).signals) == set(bicycle)


def test_laps_of_an_eight_in_closed_loop():
    """Through the crossing on the right branch, twice, though the start is late and beside the path."""
    profile = speed_profile(EIGHT, LIMITS)
    x = [*EIGHT.offset(8.0, 1.0), float(EIGHT.at(8.0).heading) + 0.2, 3.0]
    tracking = PathTracking(EIGHT, profile, acceleration=4.0)
    log = rumo.simulate(controller(), kinematic(), x, tracking, 2.1 * profile.duration)
    assert set(log["status"].data) == {"OPTIMAL"}
    states = {name: log["plant"].sel(plant_state=name).to_numpy() for name in ("p_x", "p_y", "psi", "v_x")}
    found = deviations(EIGHT, states, profile)
    late = log["time"].to_numpy() > 5.0
    assert found["progress"][-1] > 2.0 * EIGHT.length
    assert found["lap"].max() == 2
    assert np.abs(found["lateral_deviation"][late]).max() < 0.001
    assert np.abs(found["yaw_deviation"][late]).max() < 0.01
    assert np.abs(found["speed_deviation"][late]).max() < 0.1
    again = rumo.simulate(controller(), kinematic(), x, tracking, 2.0)
    np.testing.assert_array_equal(again["plant"].to_numpy(), log["plant"].to_numpy()[: again.sizes["time"]])


@settings(max_examples=40, deadline=None)
@given(st.floats(0.0, 2.9), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-1.0, 1.0))
def test_deviations_are_those_that_were_made(laps, aside, turned, v_y):
    s = laps * EIGHT.length
    there = EIGHT.at(s)
    place = EIGHT.offset(s, aside)
    x = {"p_x": place[0], "p_y": place[1], "psi": there.heading + turned, "v_x": 9.0, "v_y": v_y}
    found = deviations(EIGHT, x, EIGHT_PROFILE, near=s)
    assert found["progress"] == pytest.approx(s, abs=1e-6)
    assert found["lateral_deviation"] == pytest.approx(aside, abs=1e-6)
    assert found["yaw_deviation"] == pytest.approx(turned, abs=1e-6)
    course = (turned + np.arctan2(v_y, 9.0) + np.pi) % (2.0 * np.pi) - np.pi
    assert found["course_deviation"] == pytest.approx(course, abs=1e-6)
    assert found["speed_deviation"] == pytest.approx(np.hypot(9.0, v_y) - EIGHT_PROFILE.speed_at(s), abs=1e-6)


OPEN = Path([(0.0, 0.0), (50.0, 0.0)])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: PathTracking(OPEN, EIGHT_PROFILE),
            "profile: got one of a lap of 404.* m, expected one of this path, an open",
        ),
        (lambda: PathTracking(EIGHT, LIMITS), "profile: got .*, expected a rumo.SpeedProfile"),
        (lambda: PathTracking(EIGHT, EIGHT_PROFILE, 5.0), "vehicle: got 5.0, expected what knows its rolling"),
        (lambda: PathTracking(EIGHT, EIGHT_PROFILE, outputs=("delta",)), "outputs: got 'delta', .* come with vehicle="),
        (lambda: PathTracking(EIGHT, EIGHT_PROFILE, outputs=("corse",)), "outputs: got 'corse', .*mean 'course'"),
        (
            lambda: PathTracking(EIGHT, EIGHT_PROFILE, parameters={"mu": 0.3}),
            r"parameters\['mu'\]: got 0.3, expected a f",
        ),
        (lambda: PathTracking(EIGHT, EIGHT_PROFILE, position=("p_x",)), "position: got .*, expected two names"),
        (lambda: PathTracking(EIGHT, EIGHT_PROFILE, window=0.0), "window: got 0.0, expected a positive"),
        (
            lambda: PathTracking(EIGHT, EIGHT_PROFILE, position=("x", "y")).preview(TIMES, at(EIGHT, 0.0)),
            "position: got 'x'",
        ),
        (
            lambda: PathTracking(EIGHT, EIGHT_PROFILE, parameters={"mu": lambda s: s[:2]}).preview(
                TIMES, at(EIGHT, 0.0)
            ),
            r"parameters\['mu'\]\(s\): got shape \(2,\), expected shape \(20,\)",
        ),
        (lambda: deviations(EIGHT, {"p_x": 0.0}), "x: got no p_y, expected at least p_x and p_y"),
        (lambda: deviations(EIGHT, {"p_x": [0.0], "p_y": 1.0}), r"x\['p_y'\]: got shape \(\), expected shape \(1,\)"),
    ],
)
def test_mistakes(make, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        make()


def test_what_a_reference_starts_has_to_preview():
    class Wrong:
        def start(self, problem):
            return None

        def preview(self, times, x):
            raise AssertionError

    with pytest.raises(rumo.ArgumentError, match=r"reference.start\(\): got None, expected something with preview"):
        rumo.simulate(controller(), kinematic(), np.zeros(4), Wrong(), 1.0)


def test_profiles_say_what_they_are():
    assert repr(SpeedProfile((0.0, 10.0), (2.0, 2.0))) == "SpeedProfile(10 m, 5 s, 2 to 2 m/s)"
