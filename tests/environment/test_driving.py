"""The environment for gymnasium: its interface, and that it is the closed loop."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rumo
from rumo.references import PathTracking, Track, generators, speed_profile
from rumo.references import SpeedLimits as Limits
from rumo.simulation import ClosedLoop
from rumo.vehicles import PASSENGER_CAR, Acceleration, path_problem, rolling_bicycle

gymnasium = pytest.importorskip("gymnasium")
from gymnasium.utils.env_checker import check_env  # noqa: E402
from gymnasium.utils.seeding import np_random  # noqa: E402

from rumo.environment import DrivingEnvironment, drive_club  # noqa: E402

CAR, DRIVE = PASSENGER_CAR, Acceleration()
PATH = generators.figure_of_eight(30.0)
PROFILE = speed_profile(PATH, Limits.of_car(CAR, grip=0.6))
MODEL = rolling_bicycle(CAR, drive=DRIVE)


def scenario(**changes):
    here = PATH.at(0.0)
    motion = {"p_x": float(here.x), "p_y": float(here.y), "psi": float(here.heading), "v_x": float(PROFILE.v[0])}
    given = {
        "problem": path_problem(CAR, drive=DRIVE),
        "plant": MODEL,
        "x": dict.fromkeys(MODEL.states, 0.0) | motion,
        "reference": PathTracking(PATH, PROFILE),
        "duration": 2.0,
        "discretization": rumo.Radau2(),
        "backend": "portable",
        "observed": MODEL,
    }
    return rumo.Scenario(**{**given, **changes})


@pytest.fixture(scope="module")
def environment():
    return DrivingEnvironment(scenario())


def driven(environment, decide):
    """All steps of an episode that has begun."""
    steps = []
    while not steps or not (steps[-1][2] or steps[-1][3]):
        steps.append((*environment.step(decide(environment)), environment.sample))
    return steps


def test_gymnasium_has_nothing_to_say():
    made = gymnasium.make("rumo.environment:rumo/Drive-v0", duration=2.0)
    check_env(made.unwrapped)
    made.close()


def test_the_controllers_actions_are_the_controllers_run():
    noise = {"p_x": 0.03, "p_y": 0.03, "psi": 0.01, "v_x": 0.05, "v_y": 0.05, "omega": 0.01, "delta": 0.01}
    process = {"p_x": 1e-3, "p_y": 1e-3, "psi": 3e-4, "v_x": 0.02, "v_y": 0.02, "omega": 0.01, "delta": 1e-3}
    wanted = scenario(
        sensors=rumo.Sensors(noise), estimator=rumo.ExtendedKalman(noise=noise, process=process), duration=4.0
    )
    environment = DrivingEnvironment(wanted)
    environment.reset(seed=3)
    steps = driven(environment, DrivingEnvironment.baseline)
    seed = int(np_random(3)[0].integers(2**31))
    dt = wanted.problem.sampling_time
    log = list(ClosedLoop(replace(wanted, seed=seed, duration=wanted.duration + dt)))
    assert len(steps) == wanted.samples
    assert [step[2:4] for step in steps[:-1]] == [(False, False)] * (len(steps) - 1)
    assert steps[-1][2:4] == (False, True)
    # Actions have half as many digits.
    for step, sample in zip(steps, log[:-1], strict=True):
        np.testing.assert_allclose(step[5].plant.values, sample.plant.values, atol=2e-5)
        np.testing.assert_allclose(step[5].applied.values, sample.applied.values, atol=2e-5)
    # The reward is progress less a price, both of the truth.
    n, s = np.array([[sample.states["n"], sample.states["s"]] for sample in log]).T
    price = dt * np.sum(n[1:] ** 2)
    assert sum(step[1] for step in steps) == pytest.approx(s[-1] - s[0] - price, abs=1e-3)
    assert steps[-1][4] == pytest.approx({"time": 4.0, "progress": s[-1] - s[0], "lateral_deviation": n[-1]}, abs=1e-3)


def test_observations_are_what_is_known(environment):
    observation, info = environment.reset(seed=0)
    assert observation in environment.observation_space
    seen = dict(zip(environment.view.signals, observation.tolist(), strict=True))
    assert info == {"time": 0.0, "progress": 0.0, "lateral_deviation": pytest.approx(0.0, abs=1e-9)}
    start = {"lateral_deviation": 0.0, "yaw_deviation": 0.0, "v_x": PROFILE.v[0], "delta": 0.0, "acceleration_0": 0.0}
    assert {name: seen[name] for name in start} == pytest.approx(start, abs=1e-5)
    assert seen["curvature_0"] == pytest.approx(float(PATH.at(0.0).curvature), abs=1e-6)
    assert seen["curvature_4"] == pytest.approx(float(PATH.at(30.0).curvature), abs=1e-6)
    assert seen["speed_8"] == pytest.approx(float(PROFILE.speed_at(100.0)), abs=1e-4)
    assert environment.view.signals.unit("curvature_0") == "1/m"
    # One sample late, a command is what is decided; then it is what the car does.
    seen = dict(zip(environment.view.signals, environment.step([1.0, -0.5])[0].tolist(), strict=True))
    limits = CAR.limits
    assert seen["acceleration_0"] == pytest.approx(limits.acceleration)
    assert seen["steering_rate_0"] == pytest.approx(-0.5 * limits.steering_rate)
    seen = dict(zip(environment.view.signals, environment.step([0.0, 0.0])[0].tolist(), strict=True))
    assert seen["delta"] == pytest.approx(-0.5 * limits.steering_rate * 0.04, rel=1e-4)
    assert environment.sample.applied["acceleration"] == pytest.approx(limits.acceleration)


def test_off_the_track_an_episode_ends(environment):
    environment.reset(seed=0)
    steps = driven(environment, lambda _: [0.0, 1.0])
    assert steps[-1][2:4] == (True, False)
    assert abs(steps[-1][4]["lateral_deviation"]) > 5.0
    assert all(abs(step[4]["lateral_deviation"]) <= 5.0 for step in steps[:-1])
    with pytest.raises(rumo.CallOrderError, match=r"it is over: call reset\(\) first"):
        environment.step([0.0, 0.0])


def test_an_episode_may_begin_elsewhere(environment):
    there = PATH.at(50.0)
    x = scenario().x | {"p_x": float(there.x), "p_y": float(there.y) + 1.0, "psi": float(there.heading)}
    _, info = environment.reset(seed=1, options={"x": x})
    assert info["progress"] == 0.0
    assert info["lateral_deviation"] == pytest.approx(np.cos(float(there.heading)), abs=0.05)
    with pytest.raises(rumo.ArgumentError, match="options: got 'y', expected one of x"):
        environment.reset(options={"y": 0.0})


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 2**31), st.floats(0.0, 1.0))
def test_whatever_is_done_the_numbers_are_finite(environment, seed, size):
    rng = np.random.default_rng(seed)
    environment.reset(seed=seed)
    for observation, reward, *_ in driven(environment, lambda _: size * rng.uniform(-1.0, 1.0, 2)):
        assert observation in environment.observation_space
        assert np.isfinite(reward)


def test_a_plant_that_cannot_go_on_ends_an_episode():
    class Fragile:
        states, inputs = MODEL.states, MODEL.inputs

        def advance(self, x, u, p):
            raise rumo.PlantError("It broke.")

    environment = DrivingEnvironment(scenario(plant=Fragile()))
    environment.reset(seed=0)
    observation, reward, terminated, truncated, info = environment.step([0.0, 0.0])
    assert (reward, terminated, truncated) == (0.0, True, False)
    assert observation in environment.observation_space
    assert "It broke." in info["error"]


def test_pictures_show_the_car_on_the_road():
    environment = DrivingEnvironment(scenario(), render_mode="rgb_array")
    assert environment.render() is None
    environment.reset(seed=0)
    before = environment.render()
    assert before.shape == (400, 600, 3)
    assert before.dtype == np.uint8
    red = (before[..., 0] > 150) & (before[..., 1] < 80)
    rows, columns = np.nonzero(red)
    assert (rows.mean(), columns.mean()) == pytest.approx((200, 300), abs=6)  # in the middle
    assert red.sum() == pytest.approx(4.5 * 1.8 * (400 / (2 * 8 * 4.5)) ** 2, rel=0.25)  # as large as it is
    assert DrivingEnvironment(scenario()).render() is None


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"scenario": scenario(reference={"n": 0.0})}, "scenario.reference: got"),
        (
            {"scenario": scenario(reference=PathTracking(PATH, PROFILE, position=("p_x", "height")))},
            "scenario: got one that observes no height, expected a car whose",
        ),
        ({"track": Track(generators.circle(50.0), 5.0, 5.0)}, "track: got Track.* expected one along the reference's"),
        ({"track": -1.0}, "track: got -1.0, expected a positive"),
        ({"render_mode": "human"}, "render_mode: got 'human'"),
        ({"deviation_cost": -1.0}, "deviation_cost: got -1.0"),
        (
            {
                "scenario": scenario(
                    problem=path_problem(CAR, drive=DRIVE).changed(bounds={"steering_rate": (-np.inf, 1.0)})
                )
            },
            "scenario.problem: got 'steering_rate' without bounds",
        ),
    ],
)
def test_mistakes(arguments, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        DrivingEnvironment(**{"scenario": scenario(), **arguments})


def test_actions_are_vectors(environment):
    environment.reset(seed=0)
    for action in ([0.0], [np.nan, 0.0], "left"):
        with pytest.raises(rumo.ArgumentError, match="action"):
            environment.step(action)


def test_before_the_first_reset_there_is_nothing_to_step():
    environment = drive_club("oval", duration=1.0)
    with pytest.raises(rumo.CallOrderError, match="There is no episode"):
        environment.baseline()
    environment.close()
