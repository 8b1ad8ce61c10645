"""Logs of loops of one's own, and what logs hold besides what was recorded."""

import re
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from problems import pendulum

import rumo
from rumo.signals import NamedArray, Signals
from rumo.simulation import ClosedLoop, Plant, Scenario, load, save
from rumo.simulation.computed import limits_at


def test_a_loop_of_ones_own():
    problem = pendulum(delay=0)
    controller, plant, x = rumo.RealTimeIteration(problem), Plant(problem.model, 0.05), np.array([0.3, 0.0])
    recorder = rumo.Recorder(controller)
    for k in range(10):
        plan = controller.step(x, {"angle": 0.1})
        recorder.add(plan, time=0.05 * k, measured=x, applied=plan.command, reference={"angle": 0.1})
        x = plant.advance(x, plan.command.values, problem.parameters[0])
    log = recorder.log()
    simulated = rumo.simulate(controller, problem.model, [0.3, 0.0], {"angle": 0.1}, 0.5)
    for name in ("measured", "estimated", "applied", "commanded", "reference", "predicted_states", "constraints"):
        np.testing.assert_array_equal(log[name], simulated[name], err_msg=name)
    np.testing.assert_array_equal(log["estimated_outputs"].data, log["estimated"].data[:, :1])
    assert log.sizes["plant_state"] == 0
    rumo.show(log)


def test_signals_can_be_left_out_but_not_invented(tmp_path):
    controller = rumo.RealTimeIteration(pendulum())
    recorder = rumo.Recorder(controller)
    plan = controller.step([0.1, 0.0], {"angle": 0.0})
    recorder.add(plan, time=0.0, measured={"angle": 0.1})
    recorder.add(None, time=0.05)
    with pytest.raises(rumo.UnknownNameError, match=r"applied: got 'torqe'.*Did you mean 'torque'\?"):
        recorder.add(plan, time=0.1, applied={"torqe": 0.0})
    with pytest.raises(rumo.UnknownNameError, match=r"Recorder.add: got 'meassured'.*Did you mean 'measured'\?"):
        recorder.add(plan, time=0.1, meassured=[0.0, 0.0])
    log = load(save(recorder.log(), tmp_path / "run.nc"))
    np.testing.assert_array_equal(log["measured"], [[0.1, np.nan], [np.nan, np.nan]])
    assert log["status"].data.tolist() == ["OPTIMAL", "SKIPPED"]
    assert rumo.Recorder(controller).log().sizes["time"] == 0


def recorded(**given):
    """A recorder with a sample of which something is given."""
    controller = rumo.RealTimeIteration(pendulum(delay=0), backend="reference")
    recorder = rumo.Recorder(controller)
    recorder.add(given.pop("plan", None), **({"time": 0.0} | given))
    return recorder


def test_samples_are_kept_as_they_were():
    parameters, states, wanted = np.array([5.0]), np.array([0.1, 0.2]), np.full((13, 1), 0.3)
    recorder = recorded(parameters=parameters, measured=states, true_states=states, reference=wanted)
    for array in (parameters, states, wanted):
        array[...] = np.nan
    recorder.add(None, time=0.05, parameters={"gravity": 6.0}, reference={"angle": 0.4, "rate": 0.0})
    log = recorder.log()
    np.testing.assert_array_equal(log["parameters"][:, :, 0], [[5.0] * 12, [6.0] * 12])
    np.testing.assert_array_equal(log["measured"][0], [0.1, 0.2])
    np.testing.assert_array_equal(log["true_states"][0], [0.1, 0.2])
    np.testing.assert_array_equal(log["reference"][:, 0], [0.3, 0.4])


def test_signals_of_others_are_matched_by_name():
    backwards = NamedArray(Signals({"rate": "rad/s", "angle": "rad"}, "states"), np.array([2.0, 1.0]))
    np.testing.assert_array_equal(recorded(estimated=backwards).log()["estimated"][0], [1.0, 2.0])


def test_plants_of_ones_own_have_names():
    class Mine:
        states, inputs = {"turn": "rad"}, {"torque": "N m"}

        def advance(self, x, u, p):
            return x

    recorder = rumo.Recorder(rumo.RealTimeIteration(pendulum(), backend="reference"), Mine(), measured={"turn": "rad"})
    recorder.add(None, time=0.0, plant={"turn": 1.0}, measured=[2.0])
    log = recorder.log()
    assert (log["plant"].item(), log["measured_outputs"].item(), log.attrs["plant_model"]) == (1.0, 2.0, "Mine")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"time": "now"}, "time: got 'now', expected a finite number"),
        ({"plan": 3}, "plan: got 3, expected a rumo.Plan. It is what controller.step"),
        ({"reference": {"angel": 0.0}}, r"reference: got 'angel', .* Did you mean 'angle'\?"),
        ({"reference": [0.1] * 13}, r"reference: got shape \(13,\), expected \(13, 1\)"),
        ({"parameters": {"gravty": 9.8}}, r"parameters: got 'gravty'.* Did you mean 'gravity'\?"),
        ({"parameters": np.ones((5, 1))}, r"parameters: got shape \(5, 1\), expected shape \(12, 1\)"),
        ({"true_states": [1.0]}, r"true_states: got shape \(1,\), expected shape \(2,\)"),
    ],
)
def test_what_does_not_fit_raises_at_once(given, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        recorded(**given)


@pytest.mark.parametrize("time", [0.1, 0.05])
def test_time_runs_forward(time):
    recorder = rumo.Recorder(rumo.RealTimeIteration(pendulum(), backend="reference"))
    recorder.add(None, time=0.1)
    with pytest.raises(rumo.ArgumentError, match=rf"time: got {time:g} s, expected one after the last sample's, 0.1 s"):
        recorder.add(None, time=time)


def test_plans_of_other_problems_are_refused():
    plan = rumo.RealTimeIteration(pendulum(horizon=5), backend="reference").step([0.1, 0.0], {"angle": 0.0})
    with pytest.raises(rumo.ShapeError, match=r"predicted_states: got shape \(6, 2\), expected shape \(13, 2\)"):
        recorded(plan=plan)


def test_limits_constraints_and_outputs_are_in_the_log():
    base = pendulum().model
    model = rumo.Model(
        {"angle": "rad", "rate": "rad/s"},
        {"torque": "N m"},
        lambda x, u, p: {"angle": x.rate, "rate": u.torque - p.gravity * x.angle},
        parameters={"gravity": rumo.Parameter("m/s^2", 9.81)},
        outputs={"height": rumo.Output("m", lambda x, u, p: x.angle**2)},
        name=base.name,
    )
    problem = pendulum(
        model=model,
        track={"height": rumo.Weight(1.0), "angle": rumo.Weight(1.0)},
        bounds={"rate": rumo.Bounds(-0.5, 0.6, rumo.Penalty(1.0)), "angle": (-np.inf, 2.0)},
        constraints={"power": rumo.Constraint(lambda x, u, p: x.rate * u.torque - 1.0)},
    )
    log = rumo.simulate(rumo.RealTimeIteration(problem), model, [0.3, 0.2], {"height": 0.0, "angle": 0.0}, 0.5)
    np.testing.assert_array_equal(log["state_lower"], [[-np.inf, -0.5]] * 10)
    np.testing.assert_array_equal(log["state_upper"], [[2.0, 0.6]] * 10)
    angle, rate = log["plant"].data.T
    np.testing.assert_allclose(log["true_outputs"], np.column_stack([angle**2, angle]), rtol=1e-14)
    np.testing.assert_allclose(log["estimated_outputs"], log["true_outputs"], rtol=1e-14)
    before = log["applied"].data[:-1, 0]
    true = log["true_constraints"]
    np.testing.assert_allclose(true.sel(constraint="power")[1:], (rate[1:] * before) - 1.0, atol=1e-14)
    assert np.isnan(true.sel(constraint="power")[0])  # no input before the first sample is known
    np.testing.assert_allclose(true.sel(constraint="rate_lower"), -0.5 - rate, atol=1e-14)
    np.testing.assert_array_equal(log["slacks"], np.maximum(log["constraints"], 0.0))


def test_samples_are_recorded_by_name_as_they_are_by_place():
    """A recorder that was told the loop's own signals takes arrays as they are, any other looks names up."""
    problem = pendulum()
    model = problem.model
    sensors = rumo.Sensors({"angle": 0.01, "rate": 0.02})
    estimator = rumo.estimation.ExtendedKalman({"angle": 0.01, "rate": 0.02}, {"angle": 1e-3, "rate": 1e-3})
    scenario = Scenario(problem, model, [0.3, 0.0], {"angle": 0.1}, 0.5, sensors=sensors, estimator=estimator)
    loop = ClosedLoop(replace(scenario, faults=(rumo.faults.SkippedSample(range(3, 5)),)))
    own = rumo.Recorder(loop.controller, loop.plant, measured=loop.measured)
    named = rumo.Recorder(
        loop.controller, Plant(model, 0.05), measured=dict(zip(model.states, model.states.units, strict=True))
    )
    for sample in loop:
        own.record(sample)
        named.record(sample)
    xr.testing.assert_identical(own.log(), named.log())
    assert np.isfinite(own.log()["estimated_deviation"]).all()


def test_a_constraint_by_the_name_of_a_limit_is_none():
    problem = pendulum(
        constraints={"rate_upper": rumo.Constraint(lambda x, u, p: x.angle - 1.0)}, bounds={"torque": (-2.0, 2.0)}
    )
    np.testing.assert_array_equal(limits_at(problem, [problem.numbers])["state"], [[[-np.inf] * 2], [[np.inf] * 2]])


def test_numbers_are_those_of_the_sample():
    """Bounds, limits and parameters that change in a run, whenever its samples are recorded."""
    problem = pendulum(
        bounds={"torque": (-2.0, 2.0), "rate": rumo.Bounds(-9.0, 9.0, rumo.Penalty(1.0))},
        constraints={"power": rumo.Constraint(lambda x, u, p: p.gravity * x.rate - 1.0, rumo.Penalty(1.0))},
    )
    loop = ClosedLoop(Scenario(problem, problem.model, [0.3, 0.2], {"angle": 0.0}, 0.3))
    recorder, samples = rumo.Recorder(loop.controller, loop.plant), []
    for sample in loop:
        samples.append(sample)
        if sample.index == 2:
            loop.controller.update(
                bounds={"torque": ([-1.5] * 11 + [-9.0], 1.0), "rate": (-5.0, 5.0)},
                limits={"power": 3.0},
                parameters={"gravity": 2.0},
            )
    for sample in samples:
        recorder.record(sample)
    log = recorder.log()
    before = [True] * 3 + [False] * 3
    assert log["input_lower"].data[:, 0].tolist() == [-2.0 if early else -1.5 for early in before]
    assert log["input_upper"].data[:, 0].tolist() == [2.0 if early else 1.0 for early in before]
    assert log["state_lower"].data[:, 1].tolist() == [-9.0 if early else -5.0 for early in before]
    rate = log["true_states"].sel(state="rate").data
    gravity, limit = np.where(before, 9.81, 2.0), np.where(before, 0.0, 3.0)
    np.testing.assert_allclose(log["true_constraints"].sel(constraint="power")[1:], (gravity * rate - 1.0 - limit)[1:])


def test_bounds_in_a_log_are_those_of_the_interval_that_is_decided():
    problem = pendulum(delay=1, bounds={"torque": (-2.0, 2.0)})
    problem = problem.changed(bounds={"torque": (-2.0, [2.0, 1.5, *[1.0] * 10])})
    log = rumo.simulate(rumo.RealTimeIteration(problem), problem.model, [1.0, 0.0], {"angle": 3.0}, 0.3)
    assert (log["input_upper"] == 1.5).all()
    assert log["commanded"].max() == 1.5


def test_files_are_whole_or_not_there(tmp_path):
    from rumo.files import write_whole

    def half(place):
        place.write_text("half")
        raise KeyboardInterrupt

    path = tmp_path / "run.txt"
    assert write_whole(path, lambda place: place.write_text("whole")) == path
    with pytest.raises(KeyboardInterrupt):
        write_whole(path, half)
    assert [(item.name, item.read_text()) for item in tmp_path.iterdir()] == [("run.txt", "whole")]
    assert re.fullmatch("0o100[64]{3}", oct(path.stat().st_mode))
