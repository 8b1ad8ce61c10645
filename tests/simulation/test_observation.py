"""Controllers whose model knows a car by its place beside a path, of cars that are measured by their position."""

import numpy as np
import pytest

import rumo
from rumo.references import PathTracking, SpeedLimits, generators, speed_profile
from rumo.simulation import replay, save
from rumo.simulation.log import load
from rumo.vehicles import PASSENGER_CAR, frenet_bicycle, friction_ellipses, rolling_bicycle, slip_limits

CAR = PASSENGER_CAR
NOISE = {"p_x": 0.05, "p_y": 0.05, "psi": 0.01, "v_x": 0.05, "v_y": 0.05, "omega": 0.01, "delta": 0.01}
PROCESS = {"p_x": 1e-3, "p_y": 1e-3, "psi": 3e-4, "v_x": 0.02, "v_y": 0.02, "omega": 0.01, "delta": 1e-3}


def problem(**options):
    return rumo.Problem(
        frenet_bicycle(CAR),
        horizon=20,
        sampling_time=0.05,
        track={
            "n": rumo.Weight(40.0, 6.0),
            "velocity_across": rumo.Weight(10.0, 12.0),
            "velocity_along": rumo.Weight(1.0, 10.0),
        },
        moves={"torque": rumo.Weight(1.0, 3000.0), "steering_rate": rumo.Weight(0.3, 1.6)},
        bounds={"torque": (-2000.0, 1500.0), "steering_rate": (-0.4, 0.4), "delta": (-0.6, 0.6)},
        constraints={**friction_ellipses(CAR), **slip_limits(CAR)},
        delay=1,
        **options,
    )


def scenario(**changes):
    path = generators.figure_of_eight(30.0)
    profile = speed_profile(path, SpeedLimits.race(0.5, mu=CAR.mu, top=20.0))
    here, speed = path.at(0.0), float(profile.speed_at(0.0))
    x = {"p_x": here.x, "p_y": here.y - 0.5, "psi": here.heading, "v_x": speed, "v_y": 0.0, "omega": 0.0, "delta": 0.0}
    given = {
        "problem": problem(),
        "plant": rolling_bicycle(CAR),
        "x": {name: float(value) for name, value in x.items()},
        "reference": PathTracking(path, profile),
        "duration": 12.0,
        "discretization": rumo.Radau2(),
        "backend": "portable",
        "observed": rolling_bicycle(CAR),
    }
    return rumo.Scenario(**{**given, **changes})


@pytest.fixture(scope="module")
def log():
    estimator = rumo.ExtendedKalman(noise=NOISE, process=PROCESS)
    return scenario(sensors=rumo.Sensors(NOISE), estimator=estimator).run()


def test_the_controller_is_told_the_place_of_what_is_estimated(log):
    settled = log["time"].to_numpy() > 3.0
    n = log["true_states"].sel(state="n").to_numpy()
    assert n[0] == pytest.approx(-0.5, abs=0.15)  # beside a path that is not straight
    assert np.abs(n[settled]).max() < 0.12
    assert set(log["status"].to_numpy()[settled]) == {"OPTIMAL"}
    # The place of the estimate is about as far from the truth as the estimate is.
    wrong = (log["estimated"] - log["true_states"]).sel(state="n").to_numpy()[settled]
    distance = (log["observed"] - log["true_observed"]).sel(observed_state=["p_x", "p_y"]).to_numpy()[settled]
    assert np.sqrt(np.mean(wrong**2)) == pytest.approx(np.sqrt(np.mean(distance**2)), rel=0.2)
    # The car knows where it crosses itself: progress never jumps.
    progress = log["true_states"].sel(state="s").to_numpy()
    assert (np.diff(progress) > 0.0).all()
    assert np.diff(progress).max() < 1.5 * 20.0 * 0.05


def test_a_log_keeps_what_was_observed(log, tmp_path):
    save(log, tmp_path / "log.nc")
    again = load(tmp_path / "log.nc")
    assert list(again["observed_state"].to_numpy()) == list(rolling_bicycle(CAR).states)
    np.testing.assert_array_equal(again["observed_deviation"], log["observed_deviation"])
    # Of states that both models have, it is the deviation of what the controller was told.
    told = log["estimated_deviation"].sel(state="v_x").to_numpy()
    np.testing.assert_array_equal(told, log["observed_deviation"].sel(observed_state="v_x"))
    assert np.isnan(log["estimated_deviation"].sel(state="n")).all()


def test_a_drive_can_be_told_again(log):
    wanted = scenario()
    recording = replay.recorded(wanted.problem, log, wanted.reference)
    np.testing.assert_array_equal(recording.x, log["estimated"].to_numpy()[: len(recording)])
    v = recording.reference[:, 0, list(wanted.problem.outputs).index("velocity_along")]
    np.testing.assert_allclose(v, log["reference"].sel(output="velocity_along").to_numpy()[: len(recording)])


def test_without_an_estimator_measurements_are_believed():
    exact = scenario(duration=1.0).run()
    np.testing.assert_allclose(exact["estimated"], exact["true_states"], atol=1e-9)


def test_one_who_cannot_be_observed_is_told():
    with pytest.raises(rumo.ArgumentError, match=r"observed.*without s, n, heading_error"):
        scenario(reference={"n": 0.0, "velocity_across": 0.0, "velocity_along": 10.0}).run()
    with pytest.raises(rumo.ArgumentError, match="observed: got inputs torque, steering_angle"):
        scenario(observed=rolling_bicycle(CAR, steering=rumo.vehicles.SteeringAngle())).run()
    with pytest.raises(rumo.ArgumentError, match="observed"):
        scenario(observed="rolling_bicycle")
    # Nor is a controller whose model is by its place, if nobody says what is observed.
    with pytest.raises(rumo.RumoError, match="'s'"):
        scenario(observed=None).run()
