"""The closed loop: determinism, fairness between controllers, delay, and its failures."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import xarray as xr
from problems import pendulum

import rumo
from rumo.registry import CONTROLLERS
from rumo.simulation import Constant, OrnsteinUhlenbeck, Plant, Sensors
from rumo.studies import PaperStudy

every_controller = pytest.mark.parametrize("controller", CONTROLLERS.values(), ids=CONTROLLERS.keys())
REFERENCE = {"angle": 0.1, "rate": 0.0}


def drive(controller, seed=0, duration=1.0, **settings):
    """A pendulum with noisy sensors and varying gravity."""
    settings = {
        "sensors": Sensors({"angle": 0.01, "rate": 0.02}),
        "disturbances": {"gravity": OrnsteinUhlenbeck(9.81, 0.5, 0.3)},
    } | settings
    plant = settings.pop("plant", controller.problem.model)
    return rumo.simulate(controller, plant, [0.3, 0.0], REFERENCE, duration, seed=seed, **settings)


def without_times(log):
    """What must not depend on the machine."""
    return log.drop_vars([name for name in log.data_vars if name.endswith("_time")])


@every_controller
def test_same_seed_gives_the_same_log(controller):
    logs = [without_times(drive(controller(pendulum()), seed=5)) for _ in range(2)]
    xr.testing.assert_identical(*logs)


def test_threads_may_share_a_plant():
    problem = pendulum()
    plant = Plant(problem.model, problem.sampling_time)
    runs = [
        rumo.Scenario(problem, plant, [0.3, 0.0], REFERENCE, 2.0, sensors=Sensors({"angle": 0.05}), seed=seed)
        for seed in range(4)
    ]
    with ThreadPoolExecutor(len(runs)) as pool:
        logs = list(pool.map(rumo.Scenario.run, runs))
    for run, log in zip(runs, logs, strict=True):
        assert rumo.ClosedLoop(run).plant is not plant
        xr.testing.assert_identical(without_times(log), without_times(run.run()))


def test_a_controller_has_one_run_at_a_time():
    problem = pendulum()
    controller = rumo.RealTimeIteration(problem)
    loop = rumo.ClosedLoop(rumo.Scenario(problem, problem.model, [0.3, 0.0], REFERENCE, 0.3), controller)
    first = iter(loop)
    next(first)
    assert len(list(loop)) == len(loop)
    with pytest.raises(rumo.errors.CallOrderError, match="given to another run"):
        next(first)


@pytest.mark.parametrize("delay", [0, 1, 2])
def test_what_is_decided_outlives_a_reset(delay):
    problem = pendulum(delay=delay, bounds={"torque": (-2.0, 2.0)}, move_bounds={"torque": (-0.2, 0.2)})
    loop = rumo.ClosedLoop(rumo.Scenario(problem, problem.model, [0.0, 0.0], {"angle": 1.5}, 1.5))
    applied = []
    for sample in loop:
        applied.append(sample.applied["torque"])
        if sample.index == 15:
            loop.controller.reset()
    assert abs(applied[15]) > 1.0
    assert np.abs(np.diff(applied)).max() < 0.2 + 1e-6


@every_controller
def test_same_seed_gives_the_same_log_with_a_used_controller(controller):
    used = controller(pendulum())
    first = without_times(drive(used, seed=5))
    drive(used, seed=6)
    xr.testing.assert_identical(without_times(drive(used, seed=5)), first)


def test_other_seed_gives_other_noise_and_wind():
    logs = [drive(rumo.RealTimeIteration(pendulum()), seed=seed) for seed in (0, 1)]
    for name in ("measured", "disturbance", "applied", "plant"):
        assert not np.allclose(logs[0][name], logs[1][name])


def test_all_controllers_meet_the_same_noise_and_wind():
    logs = [drive(controller(pendulum()), seed=3) for controller in CONTROLLERS.values()]
    for log in logs[1:]:
        np.testing.assert_array_equal(log["disturbance"], logs[0]["disturbance"])
        # The noise comes back as a difference, with the rounding of states that differ.
        noise, same = ((run["measured"].data - run["plant"].data) for run in (log, logs[0]))
        np.testing.assert_allclose(noise, same, atol=1e-14)
        assert np.ptp(noise) > 0.01


def test_paper_study_is_fair_and_deterministic():
    study = PaperStudy(controllers=("rti", "ltv"), duration=0.4, seed=2)
    first, again = study.run(), study.run()
    for name in study.controllers:
        xr.testing.assert_identical(without_times(first[name]), without_times(again[name]))
    np.testing.assert_array_equal(first["rti"]["disturbance"], first["ltv"]["disturbance"])


@every_controller
@pytest.mark.parametrize("delay", [0, 1, 2])
def test_command_is_applied_after_the_delay(controller, delay):
    problem = pendulum(delay=delay, safe_input={"torque": 0.25})
    log = drive(controller(problem))
    applied, commanded = log["applied"].data, log["commanded"].data
    np.testing.assert_array_equal(applied[delay:], commanded[: len(commanded) - delay])
    np.testing.assert_array_equal(applied[:delay], 0.25)
    assert np.ptp(commanded) > 0.1


def test_noise_has_the_deviation_asked_for():
    log = drive(rumo.RealTimeIteration(pendulum()), duration=25.0)
    noise = log["measured"].data - log["plant"].data
    # Standard error of a deviation over 500 samples: 3 %; four of them.
    np.testing.assert_allclose(noise.std(axis=0), [0.01, 0.02], rtol=0.13)
    assert np.abs(noise.mean(axis=0) / [0.01, 0.02]).max() < 4.0 / np.sqrt(500)


def test_without_sensors_and_disturbances_the_states_are_exact():
    log = drive(rumo.RealTimeIteration(pendulum()), sensors=None, disturbances=None)
    np.testing.assert_array_equal(log["measured"], log["plant"])
    np.testing.assert_array_equal(log["estimated"], log["plant"])
    np.testing.assert_array_equal(log["disturbance"], 9.81)


def test_the_controller_gets_the_estimate_and_the_plant_the_disturbance():
    log = drive(rumo.RealTimeIteration(pendulum()), disturbances={"gravity": Constant(3.0)})
    np.testing.assert_array_equal(log["predicted_states"][:, 0], log["estimated"])
    np.testing.assert_array_equal(log["disturbance"], 3.0)


def test_plant_moves_by_what_the_log_says_it_was_given():
    log = drive(rumo.RealTimeIteration(pendulum()))
    plant = Plant(pendulum().model, 0.05)
    for k in range(len(log["time"]) - 1):
        end = plant.advance(log["plant"].data[k], log["applied"].data[k], log["disturbance"].data[k])
        np.testing.assert_array_equal(end, log["plant"].data[k + 1])


def test_progress_is_reported_for_each_sample():
    calls = []
    drive(rumo.RealTimeIteration(pendulum()), duration=0.25, progress=lambda *counts: calls.append(counts))
    assert calls == [(k, 5) for k in range(1, 6)]


@pytest.mark.parametrize(("duration", "samples"), [(0.05, 1), (0.3, 6), (1.0, 20)])
def test_duration_sets_the_number_of_samples(duration, samples):
    time = drive(rumo.RealTimeIteration(pendulum()), duration=duration)["time"]
    np.testing.assert_allclose(time, 0.05 * np.arange(samples))


@pytest.mark.parametrize("duration", [0.0, 0.04, -1.0, np.nan])
def test_duration_below_a_sample_is_refused(duration):
    with pytest.raises(rumo.ArgumentError, match=r"duration: got .* at least one sampling time of 0.05 s"):
        drive(rumo.RealTimeIteration(pendulum()), duration=duration)


def test_missing_plant_output_is_named():
    blind = rumo.Model({"angle": "rad"}, {"torque": "N m"}, lambda x, u, p: {"angle": u.torque}, name="blind")
    with pytest.raises(rumo.UnknownNameError, match=r"'rate'.*Give blind an output of this name"):
        rumo.simulate(rumo.RealTimeIteration(pendulum()), blind, [0.1], REFERENCE, 1.0)


def test_missing_plant_input_is_named():
    still = rumo.Model(
        {"angle": "rad", "rate": "rad/s"}, {"force": "N"}, lambda x, u, p: {"angle": 0.0, "rate": u.force}
    )
    with pytest.raises(rumo.UnknownNameError, match="plant: got 'torque', expected one of force"):
        rumo.simulate(rumo.RealTimeIteration(pendulum()), still, [0.1, 0.0], REFERENCE, 1.0)


def test_unknown_disturbance_is_named():
    with pytest.raises(rumo.UnknownNameError, match=r"disturbances: got 'gravitiy'.*Did you mean 'gravity'\?"):
        drive(rumo.RealTimeIteration(pendulum()), disturbances={"gravitiy": Constant(9.81)})


def test_plant_that_blows_up_hands_over_the_log_so_far():
    # rate' = rate^2: from 2.1 rad/s it reaches infinity at 1 / 2.1 = 0.476 s.
    plant = rumo.Model(
        {"angle": "rad", "rate": "rad/s"},
        {"torque": "N m"},
        lambda x, u, p: {"angle": x.rate, "rate": x.rate**2},
        name="escape",
    )
    controller = rumo.RealTimeIteration(pendulum())
    with pytest.raises(rumo.PlantError, match=r"At t = 0.45 s: .*escape") as caught:
        rumo.simulate(controller, plant, [0.0, 2.1], REFERENCE, 2.0)
    log = caught.value.log
    # The last sample is the one from which the plant did not reach the next.
    np.testing.assert_allclose(log["time"], 0.05 * np.arange(10))
    assert np.isfinite(log["plant"]).all()
    # Errors of 1e-8 grow by (1 - 2.1 t)^-2 = 300 towards infinity.
    np.testing.assert_allclose(log["plant"].sel(plant_state="rate"), 2.1 / (1.0 - 2.1 * log["time"].data), rtol=1e-4)
