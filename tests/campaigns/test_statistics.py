"""Intervals, correlations and differences, against closed forms and SciPy."""

import numpy as np
import pytest
from scipy.stats import binomtest, norm, spearmanr, t

from rumo.campaigns.judging.statistics import (
    difference_interval,
    discordance,
    holm,
    mean_interval,
    paired,
    rank_correlation,
    wilson,
)


@pytest.mark.parametrize(
    ("passed", "runs"), [(0, 1), (1, 1), (0, 20), (7, 20), (20, 20), (187, 200), (99_990, 100_000)]
)
def test_wilsons_interval_is_that_of_scipy(passed, runs):
    found, expected = wilson(passed, runs), binomtest(passed, runs).proportion_ci(0.95, method="wilson")
    assert found.value == passed / runs
    np.testing.assert_allclose((found.low, found.high), (expected.low, expected.high), rtol=1e-12, atol=1e-15)


def test_no_runs_say_nothing():
    assert wilson(0, 0).value is wilson(0, 0).low is None
    assert mean_interval(np.array([np.nan])).value is None
    assert difference_interval(np.empty(0), np.ones(3)).value is None
    nothing = paired(np.array([1.0, np.nan]), np.array([np.nan, 1.0]))
    assert (nothing.pairs, nothing.less, nothing.mean.low) == (0, None, None)


@pytest.mark.parametrize("count", [60, 2000, 2001, 50_000])
def test_the_mean_of_normal_values_has_the_interval_of_the_closed_form(count):
    values = np.random.default_rng(3).normal(1.0, 2.0, count)
    found = mean_interval(values)
    half = t.ppf(0.975, count - 1) * values.std(ddof=1) / np.sqrt(count)
    assert found.value == pytest.approx(values.mean())
    np.testing.assert_allclose((found.high - found.low) / 2.0, half, rtol=0.08)
    np.testing.assert_allclose((found.high + found.low) / 2.0, values.mean(), atol=0.1 * half)
    assert found == mean_interval(values)  # the same seed, the same interval


def test_nineteen_of_twenty_intervals_hold_the_mean_of_skewed_values():
    random = np.random.default_rng(0)
    found = [mean_interval(random.exponential(1.0, 50), seed) for seed in range(200)]
    held = sum(each.low <= 1.0 <= each.high for each in found)
    assert binomtest(held, 200, 0.94).pvalue > 0.01


def test_runs_that_are_not_paired_differ_by_the_closed_form():
    random = np.random.default_rng(1)
    a, b = random.normal(2.0, 1.0, 300), random.normal(1.5, 3.0, 400)
    found = difference_interval(a, b)
    half = norm.ppf(0.975) * np.sqrt(a.var() / 300 + b.var() / 400)
    assert found.value == pytest.approx(a.mean() - b.mean())
    np.testing.assert_allclose((found.high - found.low) / 2.0, half, rtol=0.08)


def test_pairs_take_out_what_draws_have_in_common():
    random = np.random.default_rng(2)
    draws = random.normal(0.0, 10.0, 200)
    a, b = draws + random.normal(0.1, 0.1, 200), draws
    b[5] = np.nan
    found = paired(a, b)
    assert found.pairs == 199
    assert found.mean.low < 0.1 < found.mean.high
    assert found.mean.high - found.mean.low < 0.04  # the draws' own spread would make it 100 times that
    assert found.less + found.more == pytest.approx(1.0)
    assert found.less == pytest.approx(norm.cdf(-1.0), abs=0.08)


@pytest.mark.parametrize("values", [np.full(30, 2.0), np.r_[np.zeros(29), 1.0], np.array([1.0, 2.0])])
def test_values_that_hardly_differ_have_a_mean_and_no_warning(values):
    found = mean_interval(values)
    assert found.value == pytest.approx(values.mean())
    assert found.low is None if values.size < 8 else found.low <= found.value <= found.high


def test_rank_correlation_is_spearmans():
    random = np.random.default_rng(4)
    x = random.integers(0, 10, 100).astype(float)
    y = x**3 + random.normal(0.0, 200.0, 100)
    y[3] = np.nan
    expected, found = spearmanr(np.delete(x, 3), np.delete(y, 3)), rank_correlation(x, y)
    assert (found.rho, found.chance) == (pytest.approx(expected.statistic), pytest.approx(expected.pvalue))
    assert found.clear
    assert rank_correlation(np.ones(10), np.arange(10.0)) is None
    assert rank_correlation(np.arange(4.0), np.arange(4.0)) is None


def test_holm_corrects_for_how_many_tests_there_are():
    random = np.random.default_rng(3)
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])  # Holm's steps, by hand
    assert (holm([]), holm([0.2]), holm([0.9, 0.8])) == ([], [0.2], [1.0, 1.0])
    tests = random.uniform(size=(2000, 5))  # nothing differs: any test errs in 5 of a hundred families at most
    assert np.mean([min(holm(each)) < 0.05 for each in tests.tolist()]) == pytest.approx(0.05, abs=0.015)


def test_who_passes_alone():
    a, b = np.array([1, 1, 1, 1, 0, 0, 1]) > 0, np.array([1, 0, 0, 0, 1, 0, 1]) > 0
    found = discordance(a, b)
    assert (found.both, found.first, found.second, found.neither) == (2, 3, 1, 1)
    assert found.chance == pytest.approx(2 * (1 + 4) / 16)  # heads at most once in four
    assert discordance(a, a).chance == 1.0
