"""A recorded drive, told to the same controller again, gives the same commands."""

import numpy as np
import pytest
from problems import pendulum

import rumo
from rumo.simulation.replay import recorded


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_same_commands(delay):
    problem = pendulum(delay=delay)

    def reference(times):
        return {"angle": 0.3 * np.sin(2.0 * times)}

    controller = rumo.RealTimeIteration(problem, backend="portable")
    log = rumo.simulate(controller, problem.model, [0.1, 0.0], reference, 2.0, applied=[0.5])
    recording = recorded(problem, log, reference)
    first, decided = (0 if delay else 1), max(delay, 1)
    assert len(recording) == 40 - first - decided + 1
    assert recording.applied.shape == (len(recording), decided, 1)
    # The first sample of a recording without delay is the second of the drive; what the drive planned then is not told.
    controller.reset(applied=[0.5])
    if not delay:
        controller.step(log.estimated.values[0], reference(problem.times))
    commands = []
    for x, wanted, applied in zip(recording.x, recording.reference, recording.applied, strict=True):
        np.testing.assert_allclose(controller.applied, applied, rtol=0.0, atol=1e-9)
        commands.append(controller.step(x, wanted).command.values)
    np.testing.assert_allclose(commands, log.commanded.values[first : first + len(commands)], rtol=0.0, atol=1e-9)


def test_references_are_those_that_simulate_takes():
    problem = pendulum()
    controller = rumo.RealTimeIteration(problem, backend="portable")
    log = rumo.simulate(controller, problem.model, [0.1, 0.0], {"angle": 0.3}, 0.5)
    for reference in ({"angle": 0.3}, lambda times: {"angle": 0.3}):
        np.testing.assert_array_equal(recorded(problem, log, reference).reference, np.full((10, 13, 1), 0.3))
    with pytest.raises(rumo.ArgumentError, match=r"log: got 2 samples, expected at least 3, with this delay\."):
        recorded(pendulum(delay=3), log.isel(time=slice(0, 2)), {"angle": 0.3})


def test_times_of_a_replay():
    problem = pendulum()
    controller = rumo.RealTimeIteration(problem, backend="portable")
    log = rumo.simulate(controller, problem.model, [0.1, 0.0], {"angle": 0.3}, 1.0)
    recording = recorded(problem, log, {"angle": 0.3})
    controller.reset()
    linearize, prepare, feedback = controller.replay(recording.x, recording.reference, recording.applied).T
    assert len(linearize) == 20
    assert (linearize <= prepare).all()
    assert (np.r_[linearize, prepare, feedback] > 0.0).all()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"x": np.zeros((3, 5))}, r"x: got shape \(3, 5\), expected shape \(3, 2\)"),
        ({"x": 0.0}, r"x: got shape \(\), expected shape \(2,\)"),
        ({"reference": np.zeros((2, 13, 1))}, r"reference: got shape \(2, 13, 1\), expected shape \(3, 13, 1\)"),
        ({"applied": np.zeros((3, 1))}, r"applied: got shape \(3, 1\), expected shape \(3, 1, 1\)"),
        ({"applied": np.full((3, 1, 1), np.nan)}, "applied: got NaN or infinity, expected finite inputs"),
    ],
)
def test_what_cannot_be_replayed(changes, message):
    controller = rumo.RealTimeIteration(pendulum(), backend="portable")
    told = {"x": np.zeros((3, 2)), "reference": np.zeros((3, 13, 1)), "applied": np.zeros((3, 1, 1))}
    with pytest.raises(rumo.ArgumentError, match=message):
        controller.replay(**told | changes)
    assert not controller.status_counts
