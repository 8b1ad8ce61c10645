"""Innovations judged, and process noise found from them."""

import re
from dataclasses import replace

import numpy as np
import pytest
from filters import NOISE, PROCESS, drive, estimates, noisy, pendulum_with_outputs
from scipy.stats import chi2

import rumo
from rumo.estimation import ExtendedKalman, Innovation, OutlierGate, consistency, fit_process_noise
from rumo.references import SinePath
from rumo.studies import PaperStudy
from rumo.studies.paper import kalman_filter
from rumo.vehicles import PAPER_CAR


def innovations(seed=0, samples=2000, **settings):
    problem = pendulum_with_outputs()
    x, torques = drive(problem, samples, seed)
    told, _ = estimates(problem, noisy(x, seed + 1), torques, **settings)
    return [estimate.innovation for estimate in told]


def test_a_filter_that_is_right_is_consistent():
    """In nine of ten drives or so, at a confidence of nine in ten; and each channel by itself as well."""
    judged = [consistency(innovations(seed, 300), ("angle", "rate"), confidence=0.9) for seed in range(20)]
    assert sum(one.consistent for one in judged) >= 14
    inside = [
        channel.interval[0] <= channel.mean_square <= channel.interval[1]
        for one in judged
        for channel in one.channels.values()
    ]
    assert np.mean(inside) > 0.8
    assert abs(np.mean([channel.mean for one in judged for channel in one.channels.values()])) < 0.03
    assert abs(np.mean([channel.correlation for one in judged for channel in one.channels.values()])) < 0.03


@pytest.mark.parametrize(("factor", "side"), [(0.5, 1), (2.0, -1)])
def test_one_that_expects_other_noise_is_not(factor, side):
    judged = consistency(innovations(noise={name: factor * value for name, value in NOISE.items()}), ("angle", "rate"))
    assert not judged.consistent
    assert (judged.nis - judged.expected) * side > 0.0


def test_intervals_are_those_of_chi_square():
    """Of missing measurements nothing is expected."""
    known = Innovation(np.array([1.0, np.nan]), np.array([2.0, np.nan]), np.array([True, False]), 0.25, -1.0)
    both = Innovation(np.array([1.0, 3.0]), np.array([2.0, 1.0]), np.array([True, False]), 0.25, -1.0)
    judged = consistency([None, known, both, known], ("a", "b"), confidence=0.95)
    assert (judged.nis, judged.expected, judged.samples) == (0.25, 1.0, 3)
    np.testing.assert_allclose(judged.interval, chi2.ppf([0.025, 0.975], 3) / 3)
    assert (judged.channels["b"].used, judged.channels["b"].refused) == (0, 1)
    assert judged.channels["a"].mean == 0.5
    assert "NIS 0.25, expected 1.00" in str(judged)


@pytest.mark.parametrize(
    ("arguments", "settings", "message"),
    [
        (([None], ("a",)), {}, "source: got no innovations"),
        ((["much"], ("a",)), {}, "source: got 'much', expected a rumo.Innovation"),
        (([], ("a",)), {"confidence": 1.0}, "confidence: got 1, expected a number between 0 and 1"),
    ],
)
def test_arguments_are_checked(arguments, settings, message):
    with pytest.raises(rumo.ArgumentError, match=re.escape(message)):
        consistency(*arguments, **settings)


def pendulum_log(seed, estimator, problem=None, samples=500):
    """A log made by a recorder, of a drive that the filter's own model makes."""
    problem = problem or pendulum_with_outputs()
    x, torques = drive(problem, samples, seed)
    controller = rumo.RealTimeIteration(problem)
    recorder, running = rumo.simulation.Recorder(controller, problem.model), estimator.start(problem)
    measured = noisy(x, seed + 1)
    for k in range(samples):
        estimate = running.update(measured[k], torques[k], problem.parameters[0])
        applied = torques[k + 1] if k + 1 < samples else torques[k]
        recorder.add(
            None,
            time=0.05 * k,
            measured=measured[k],
            estimated=estimate.x,
            applied=applied,
            innovation=estimate.innovation,
        )
    return recorder.log()


@pytest.mark.parametrize("start", [(0.1, 10.0), (10.0, 0.1)])
def test_process_noise_is_found_from_what_was_measured(start):
    """From ten times off in either direction, to what it was, or to what is too small to be seen."""
    wrong = {name: factor * value for (name, value), factor in zip(PROCESS.items(), start, strict=True)}
    estimator = ExtendedKalman(NOISE, wrong)
    problem = pendulum_with_outputs()
    fitted = fit_process_noise(estimator, problem, [pendulum_log(seed, estimator) for seed in (3, 7)], decades=1.5)
    assert fitted.process["rate"] == pytest.approx(PROCESS["rate"], rel=0.2)
    assert fitted.process["angle"] < 3.0 * PROCESS["angle"]
    assert fitted.noise == NOISE
    assert consistency(pendulum_log(11, fitted)).consistent
    assert not consistency(pendulum_log(11, estimator)).consistent


def test_outliers_do_not_count():
    estimator = ExtendedKalman(NOISE, PROCESS, gate=OutlierGate())
    problem, log = pendulum_with_outputs(), pendulum_log(3, estimator)
    log["received"][::9, 0] += 1.0
    fitted = fit_process_noise(estimator, problem, log)
    assert fitted.process["rate"] == pytest.approx(PROCESS["rate"], rel=0.25)
    assert fitted.gate == OutlierGate()


def test_logs_must_go_together():
    estimator = ExtendedKalman(NOISE, PROCESS)
    log = pendulum_log(0, estimator, samples=40)
    other = log.isel(measurement=[0])
    with pytest.raises(rumo.ArgumentError, match="logs: got different measurements"):
        fit_process_noise(estimator, pendulum_with_outputs(), [log, other])


def test_the_studys_filter_expects_what_it_meets():
    """At a speed and in a wind that it was not tuned with; and it knows where the car is to within 2 cm."""
    path = SinePath(3.0, 50.0, 12.0, PAPER_CAR)
    study = PaperStudy(("rti",), path=path, duration=12.0, seed=3, estimator=kalman_filter())
    log = study.run()["rti"]
    judged = consistency(log, after=2.0)
    assert judged.nis == pytest.approx(9.0, rel=0.06)
    late = log.sel(time=slice(2.0, None), state=["p_x", "p_y"])
    error = (late["estimated"] - late["true_states"]).to_numpy()
    assert np.sqrt((error**2).sum(axis=1).mean()) < 0.02
    euler = replace(kalman_filter(), discretization=rumo.ImplicitEuler())
    assert consistency(replace(study, estimator=euler).run()["rti"], after=2.0).nis > 1.4 * judged.nis
