"""Butterworth filter: its coefficients, its lag, its start, angles, and samples that are not finite."""

from itertools import pairwise

import numpy as np
import pytest
from scipy import signal

import rumo
from rumo.estimation import Butterworth

DT = 0.04
NOTHING = np.zeros(0)


def problem(units=("m",), dt=DT):
    """A problem whose model has one state per unit."""
    states = {f"x{i}": unit for i, unit in enumerate(units)}
    model = rumo.Model(states, {"u": "1"}, lambda x, u, p: dict.fromkeys(states, u.u))
    return rumo.Problem(
        model, horizon=2, sampling_time=dt, track={"x0": rumo.Weight(1.0)}, moves={"u": rumo.Weight(1.0)}
    )


def filtered(samples, units=("m",), cutoff=3.5, order=1, dt=DT):
    """Estimates (K, nx) for samples (K, nx)."""
    running = Butterworth(cutoff, order).start(problem(units, dt))
    return np.array([running.update(sample, np.zeros(1), NOTHING).x for sample in np.asarray(samples, dtype=float)])


def noise(n, columns=1, seed=0):
    return np.random.default_rng(seed).normal(size=(n, columns))


@pytest.mark.parametrize("order", [1, 2, 4])
@pytest.mark.parametrize("cutoff", [0.5, 3.5, 11.0])
def test_equals_scipys_filter_started_in_steady_state(cutoff, order):
    samples = 5.0 + noise(200)
    b, a = signal.butter(order, cutoff, fs=1.0 / DT)
    expected, _ = signal.lfilter(b, a, samples[:, 0], zi=signal.lfilter_zi(b, a) * samples[0, 0])
    # Sections against one polynomial: the rounding of a fourth-order polynomial at a low cutoff.
    np.testing.assert_allclose(filtered(samples, cutoff=cutoff, order=order)[:, 0], expected, rtol=1e-8)


@pytest.mark.parametrize("cutoff", [0.5, 3.5, 11.0])
def test_first_order_recursion_in_closed_form(cutoff):
    # Tustin's method on 1 / (1 + s / w) with K = tan(pi f dt): the cutoff stays at f.
    K = np.tan(np.pi * cutoff * DT)
    samples = 5.0 + noise(100)[:, 0]
    expected = [samples[0]]
    for before, now in pairwise(samples):
        expected.append((K * (now + before) + (1.0 - K) * expected[-1]) / (1.0 + K))
    np.testing.assert_allclose(filtered(samples[:, None], cutoff=cutoff)[:, 0], expected, rtol=1e-12)


@pytest.mark.parametrize("order", [1, 2])
def test_attenuates_by_3_db_at_the_cutoff(order):
    # A complex wave keeps its magnitude; the first half is the transient.
    t = DT * np.arange(5000)
    wave = np.exp(2j * np.pi * 3.5 * t)
    real, imaginary = filtered(np.column_stack([wave.real, wave.imag]), units=("m", "m"), order=order).T
    gain = np.abs(real + 1j * imaginary)[2500:]
    np.testing.assert_allclose(gain, np.sqrt(0.5), rtol=1e-9)


def test_lags_by_45_ms_at_low_frequency():
    # A ramp of 8 m/s comes out late by the lag, once the transient of one sample in three has died away.
    ramp = 8.0 * DT * np.arange(200)
    lag = (ramp - filtered(ramp[:, None])[:, 0])[-1] / 8.0
    # The first-order low-pass lags by 1 / (2 pi f) = 45.5 ms; Tustin's method with the cutoff kept in place by
    # dt / (2 tan(pi f dt)) = 42.5 ms. At 8 m/s that is 0.34 m.
    assert lag == pytest.approx(0.5 * DT / np.tan(np.pi * 3.5 * DT), rel=1e-9)
    assert lag == pytest.approx(0.045, abs=0.003)


def test_starts_at_the_first_sample_in_steady_state():
    np.testing.assert_allclose(filtered(np.full((5, 1), 7.0)), 7.0, rtol=1e-12)


def test_signals_do_not_mix():
    samples = noise(50, columns=3)
    together = filtered(samples, units=("m", "m/s", "1"))
    for column in range(3):
        np.testing.assert_array_equal(together[:, [column]], filtered(samples[:, [column]]))


def test_angles_are_unwrapped_and_other_signals_are_not():
    turning = 0.2 * np.arange(100)
    wrapped = np.angle(np.exp(1j * turning))
    angle, length = filtered(np.column_stack([wrapped, wrapped]), units=("rad", "m")).T
    # The filtered angle goes on turning; a whole turn is removed with the rounding of 2 pi.
    np.testing.assert_allclose(angle, filtered(turning[:, None])[:, 0], atol=1e-12)
    assert np.abs(length).max() <= np.pi


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_bad_sample_passes_through_and_leaves_the_memory_sound(bad):
    samples = noise(20, columns=2)
    running = Butterworth().start(problem(("m", "rad")))
    results = []
    for k, sample in enumerate(samples):
        if k == 7:
            spoilt = np.array([bad, 0.3])
            np.testing.assert_array_equal(running.update(spoilt, np.zeros(1), NOTHING).x, spoilt)
        results.append(running.update(sample, np.zeros(1), NOTHING).x)
    np.testing.assert_array_equal(results, filtered(samples, units=("m", "rad")))


def test_bad_first_sample_does_not_start_the_filter():
    running = Butterworth().start(problem())
    assert np.isnan(running.update(np.array([np.nan]), np.zeros(1), NOTHING).x)
    assert running.update(np.array([4.0]), np.zeros(1), NOTHING).x == pytest.approx(4.0)


def test_measurement_is_not_modified():
    running = Butterworth().start(problem(("rad",)))
    for value in (3.0, -3.0):
        sample = np.array([value])
        running.update(sample, np.zeros(1), NOTHING)
        assert sample[0] == value


@pytest.mark.parametrize("cutoff", [12.5, 20.0, 0.0, -1.0, np.nan, "10"])
def test_cutoff_outside_the_sampled_band_is_refused(cutoff):
    with pytest.raises(rumo.ArgumentError, match=r"cutoff: got .* Hz, expected a frequency between 0 and 12.5 Hz"):
        Butterworth(cutoff).start(problem())
