"""Delays found from commands and responses."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

import rumo
from rumo.estimation import DelayMonitor

DT = 0.04


def commands(seed, samples=400):
    """A wandering command without what is faster than 2 Hz, as a function of time."""
    rough = np.random.default_rng(seed).normal(size=samples)
    return CubicSpline(DT * np.arange(samples), sosfiltfilt(butter(2, 2.0, fs=1.0 / DT, output="sos"), rough))


def followed(command, delay, noise=0.0, gain=1.0, seed=0, monitor=None, missing=()):
    """A monitor that has seen the command, and the response to it so much later."""
    monitor = monitor or DelayMonitor(DT)
    rng, times = np.random.default_rng(seed), DT * np.arange(50, 350)
    for k, t in enumerate(times):
        response = np.nan if k in missing else gain * float(command(t - delay)) + 3.0 + noise * rng.normal()
        monitor.update(float(command(t)), response)
    return monitor


@settings(max_examples=25, deadline=None)
@given(st.floats(0.0, 19.0), st.integers(0, 1000), st.sampled_from([0.1, 1.0, 50.0]))
def test_fractions_of_a_sample_are_found(samples, seed, gain):
    """Whatever size and offset the response has."""
    monitor = followed(commands(seed), samples * DT, gain=gain)
    assert monitor.delay == pytest.approx(samples * DT, abs=0.08 * DT)
    assert monitor.correlation > 0.95


def test_noise_and_gaps_matter_little():
    monitor = followed(commands(3), 4.3 * DT, noise=0.05, missing=set(range(0, 300, 3)))
    assert monitor.delay == pytest.approx(4.3 * DT, abs=0.3 * DT)


def test_it_follows_a_delay_that_changes():
    command = commands(1)
    monitor = followed(command, 2.0 * DT)
    assert followed(command, 6.5 * DT, monitor=monitor).delay == pytest.approx(6.5 * DT, abs=0.1 * DT)


@pytest.mark.parametrize(
    "response", [lambda t: 0.0, lambda t: np.nan, lambda t: np.random.default_rng(int(1e3 * t)).normal()]
)
def test_what_does_not_follow_has_no_delay(response):
    command, monitor = commands(2), DelayMonitor(DT)
    for t in DT * np.arange(300):
        assert np.isnan(monitor.update(float(command(t)), response(t)))


def test_it_is_not_known_at_once_nor_beyond_the_longest():
    assert np.isnan(DelayMonitor(DT).update(1.0, 1.0))
    assert np.isnan(followed(commands(4), 30.0 * DT).delay)


@pytest.mark.parametrize(
    ("settings", "name"),
    [
        ({"sampling_time": 0.0}, "sampling_time"),
        ({"sampling_time": 0.1, "window": 3}, "window"),
        ({"sampling_time": 0.1, "longest": 0}, "longest"),
        ({"sampling_time": 0.1, "least_correlation": 0.0}, "least_correlation"),
    ],
)
def test_settings_are_checked(settings, name):
    with pytest.raises(rumo.ArgumentError, match=name):
        DelayMonitor(**settings)
