"""Loops in which somebody else decides."""

import numpy as np
import pytest
from problems import pendulum

import rumo
from rumo.simulation import ClosedLoop, Moment, Sample, Scenario, faults


def scenario(delay=0, **changes):
    problem = pendulum(delay=delay)
    return Scenario(problem, problem.model, [0.3, 0.0], {"angle": 0.1}, 0.5, **changes)


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_commands_take_the_way_of_a_controllers(delay):
    loop = ClosedLoop(scenario(delay))
    rng, moments, applied, sent = np.random.default_rng(delay), loop.moments(), [], []
    for k, moment in enumerate(moments):
        assert isinstance(moment, Moment)
        assert moment.index == k
        assert moment.decided.shape == (max(delay, 1), 1)
        if delay and k:  # what is decided is what was sent last, or the safe input
            assert moment.decided[-1, 0] == sent[-1]
        sent.append(rng.uniform(-1.0, 1.0))
        sample = moments.send(np.array([sent[-1]]))
        assert isinstance(sample, Sample)
        assert sample.plan is None
        np.testing.assert_array_equal(sample.estimated.values, moment.estimated.values)
        applied.append(sample.applied["torque"])
    assert len(applied) == len(loop)
    assert applied == [0.0] * delay + sent[: len(sent) - delay]


def test_the_controllers_own_plans_make_the_controllers_own_run():
    wanted = scenario(1, sensors=rumo.Sensors({"angle": 0.01}))
    moments = ClosedLoop(wanted).moments()
    states = [moments.send(moment.plan()).plant.values for moment in moments]
    np.testing.assert_array_equal(states, wanted.run()["plant"])


def test_no_command_leaves_the_actuators_as_they_are():
    moments = ClosedLoop(scenario(applied=[0.7])).moments()
    assert [moments.send(None).applied["torque"] for _ in moments] == [0.7] * 10


def test_what_computes_nothing_sends_nothing():
    moments = ClosedLoop(scenario(faults=(faults.SkippedSample(when=range(2, 4)),))).moments()
    applied = [moments.send(np.array([0.1 * moment.index])).applied["torque"] for moment in moments]
    assert applied == pytest.approx([0.0, 0.1, 0.1, 0.1, *(0.1 * np.arange(4, 10))])


@pytest.mark.parametrize(
    ("command", "message"),
    [([np.nan], r"command\['torque'\]: got nan"), ([0.0, 1.0], r"command: got shape \(2,\), expected shape \(1,\)")],
)
def test_commands_are_inputs(command, message):
    moments = ClosedLoop(scenario()).moments()
    next(moments)
    with pytest.raises(rumo.ArgumentError, match=message):
        moments.send(np.array(command))
