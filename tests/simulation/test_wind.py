"""Disturbances: their statistics, their shape, and that the generator alone decides."""

import numpy as np
import pytest

import rumo
from rumo.simulation import Constant, Gust, OrnsteinUhlenbeck, RandomWalk

TIMES = 0.04 * np.arange(600)
KINDS = {
    "constant": Constant(2.0),
    "random_walk": RandomWalk(2.0, 1.5),
    "ornstein_uhlenbeck": OrnsteinUhlenbeck(2.0, 1.5, 3.0),
    "gust": Gust(2.0, 9.0, 5.0, 4.0),
}
every_kind = pytest.mark.parametrize("wind", KINDS.values(), ids=KINDS.keys())
random_kinds = pytest.mark.parametrize("wind", [KINDS["random_walk"], KINDS["ornstein_uhlenbeck"]])


def sample(wind, times=TIMES, seed=0):
    return wind.sample(times, np.random.default_rng(seed))


@every_kind
@pytest.mark.parametrize("count", [1, 2, 600])
def test_one_finite_value_for_each_time(wind, count):
    values = sample(wind, TIMES[:count])
    assert values.shape == (count,)
    assert np.isfinite(values).all()


@every_kind
def test_same_seed_gives_the_same_wind(wind):
    np.testing.assert_array_equal(sample(wind, seed=3), sample(wind, seed=3))


@random_kinds
def test_other_seed_gives_another_wind(wind):
    assert not np.allclose(sample(wind, seed=3), sample(wind, seed=4))


def test_constant_stays():
    np.testing.assert_array_equal(sample(Constant(-3.5)), np.full(600, -3.5))


@pytest.mark.parametrize("seed", range(3))
def test_random_walk_has_the_mean_and_deviation_asked_for(seed):
    values = sample(RandomWalk(2.0, 1.5), seed=seed)
    # By construction, to rounding.
    assert values.mean() == pytest.approx(2.0)
    assert values.std() == pytest.approx(1.5)


def test_random_walk_is_integrated_white_noise():
    steps = np.diff(sample(RandomWalk(0.0, 1.0), 0.04 * np.arange(20_000)))
    # Correlation of neighbouring steps: zero within four standard errors of 1 / sqrt(20 000).
    assert abs(np.corrcoef(steps[1:], steps[:-1])[0, 1]) < 4.0 / np.sqrt(20_000)


def test_ornstein_uhlenbeck_is_stationary_with_the_statistics_asked_for():
    wind, rng = OrnsteinUhlenbeck(2.0, 1.5, 0.4), np.random.default_rng(0)
    runs = np.array([wind.sample(TIMES[:21], rng) for _ in range(4000)])
    # Standard errors over 4000 runs: 0.024 of a mean, 0.017 of a deviation; four of them.
    for column in (0, 10, 20):
        assert runs[:, column].mean() == pytest.approx(2.0, abs=0.1)
        assert runs[:, column].std() == pytest.approx(1.5, abs=0.07)
    # Ten samples are a correlation time: 1/e, standard error 0.014.
    assert np.corrcoef(runs[:, 5], runs[:, 15])[0, 1] == pytest.approx(np.exp(-1.0), abs=0.06)


def test_ornstein_uhlenbeck_does_not_depend_on_the_sampling():
    coarse, fine = TIMES[:600:10], TIMES[:600]
    wind = OrnsteinUhlenbeck(0.0, 1.0, 0.4)
    runs = [np.array([sample(wind, times, seed) for seed in range(1000)]) for times in (coarse, fine)]
    correlations = [np.corrcoef(runs[0][:, 0], runs[0][:, 1])[0, 1], np.corrcoef(runs[1][:, 0], runs[1][:, 10])[0, 1]]
    # Both 1/e; standard error 0.027 each.
    assert correlations[0] == pytest.approx(correlations[1], abs=0.15)


def test_gust_rises_to_its_peak_and_falls_back():
    wind = Gust(mean=2.0, peak=9.0, start=5.0, duration=4.0)
    values = sample(wind, np.array([0.0, 5.0, 6.0, 7.0, 8.0, 9.0, 20.0]))
    # "1 - cosine": half of the peak at a quarter of the time.
    np.testing.assert_allclose(values, [2.0, 2.0, 5.5, 9.0, 5.5, 2.0, 2.0])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Constant("2"), "value: got '2', expected a finite number"),
        (lambda: RandomWalk(0.0, -1.0), "std: got -1.0, expected a number of at least 0"),
        (lambda: OrnsteinUhlenbeck(np.nan, 1.0, 3.0), "mean: got nan, expected a finite number"),
        (lambda: Gust(2.0, "9", 5.0, 4.0), "peak: got '9', expected a finite number"),
    ],
)
def test_mistakes(make, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        make()
