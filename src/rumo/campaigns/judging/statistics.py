"""What many runs say: shares, differences and dependences, each with how sure they are."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rumo.signals import Array

CONFIDENCE = 0.95
"""Of all intervals."""
RESAMPLES = 2000
"""Of a bootstrap."""
BLOCKS = 2000
"""More values than so many are put together in that many means: theirs has the same spread, and takes less time."""
SMALLEST = 8
"""Fewer values than this have no bootstrap worth the name."""


@dataclass(frozen=True)
class Interval:
    """An estimate, and the ends of its 95 % confidence interval; None where there is too little to say."""

    value: float | None
    low: float | None = None
    high: float | None = None

    @property
    def plain(self) -> list[float] | None:
        """The ends, for `summary.json`."""
        return None if self.low is None or self.high is None else [self.low, self.high]


def wilson(passed: int, runs: int) -> Interval:
    """Share of runs that passed, with Wilson's score interval, which is never empty and stays between 0 and 1.

    Notes
    -----
    Source: Wilson (1927), J. Am. Stat. Assoc. 22.
    """
    from scipy.special import ndtri

    if runs == 0:
        return Interval(None)
    z, share = float(ndtri(0.5 + 0.5 * CONFIDENCE)), passed / runs
    spread = z / (1.0 + z**2 / runs) * np.sqrt(share * (1.0 - share) / runs + (z / (2.0 * runs)) ** 2)
    centre = (share + z**2 / (2.0 * runs)) / (1.0 + z**2 / runs)
    # At its ends the interval has these, which rounding would miss.
    low = 0.0 if passed == 0 else float(max(centre - spread, 0.0))
    high = 1.0 if passed == runs else float(min(centre + spread, 1.0))
    return Interval(share, low, high)


def mean_interval(values: Array, seed: int = 0) -> Interval:
    """Mean of values (n,) with its bootstrap interval, bias-corrected and accelerated; the same seed, the same ends.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Of independent runs, or differences between paired ones; those that are not finite are left out.
    seed : int
        Of the resampling.

    Notes
    -----
    Source: Efron (1987), J. Am. Stat. Assoc. 82; by `scipy.stats.bootstrap`.
    """
    values = values[np.isfinite(values)]
    if not values.size:
        return Interval(None)
    mean = float(values.mean())
    if values.size < SMALLEST:
        return Interval(mean)
    if np.ptp(values) == 0.0:
        return Interval(mean, mean, mean)
    return Interval(mean, *_bootstrap((_blocks(values, seed),), _mean, seed))


def difference_interval(first: Array, second: Array, seed: int = 0) -> Interval:
    """Mean of the first values (n,) less that of the second (m,), of runs that are not paired, with its interval."""
    first, second = first[np.isfinite(first)], second[np.isfinite(second)]
    if not first.size or not second.size:
        return Interval(None)
    value = float(first.mean() - second.mean())
    if min(first.size, second.size) < SMALLEST:
        return Interval(value)
    if np.ptp(first) == 0.0 and np.ptp(second) == 0.0:
        return Interval(value, value, value)
    return Interval(value, *_bootstrap((_blocks(first, seed), _blocks(second, seed)), _difference, seed))


@dataclass(frozen=True)
class Correlation:
    """Spearman's rank correlation, from -1 to 1, and the probability that chance alone gives one as large."""

    rho: float
    chance: float

    @property
    def clear(self) -> bool:
        """Whether it is more than chance would give in one of a hundred campaigns."""
        return self.chance < 0.01


def rank_correlation(x: Array, y: Array) -> Correlation | None:
    """Spearman's rank correlation of values (n,) and (n,); None where fewer than 5 pairs are known, or one is constant.

    Notes
    -----
    By `scipy.stats.spearmanr`.
    """
    from scipy.stats import spearmanr

    known = np.isfinite(x) & np.isfinite(y)
    x, y = x[known], y[known]
    if x.size < 5 or np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return None
    found: Any = spearmanr(x, y)
    return Correlation(float(found.statistic), float(found.pvalue))


@dataclass(frozen=True)
class Paired:
    """Two sets of runs of the same draws.

    Attributes
    ----------
    pairs : int
        Of which both figures are known.
    mean : Interval
        Of the differences, first less second.
    median : float or None
        Of the differences.
    largest : float or None
        Of their sizes.
    less, more : float or None
        Shares of pairs of which the first is less, and more.
    """

    pairs: int
    mean: Interval
    median: float | None
    largest: float | None
    less: float | None
    more: float | None


def paired(first: Array, second: Array, seed: int = 0) -> Paired:
    """Differences between values (n,) and (n,) of the same draws."""
    differences = first - second
    differences = differences[np.isfinite(differences)]
    if not differences.size:
        return Paired(0, Interval(None), None, None, None, None)
    return Paired(
        differences.size,
        mean_interval(differences, seed),
        float(np.median(differences)),
        float(np.abs(differences).max()),
        float((differences < 0.0).mean()),
        float((differences > 0.0).mean()),
    )


@dataclass(frozen=True)
class Discordance:
    """How often two drivers of the same draws pass: both, one alone, neither; and how likely chance is so unequal.

    `chance` is that of the exact sign test (McNemar's) on the draws that only one of them passes.
    """

    both: int
    first: int
    second: int
    neither: int
    chance: float


def discordance(first: NDArray[np.bool_], second: NDArray[np.bool_]) -> Discordance:
    """Of what passed (n,) and (n,) in the same draws."""
    from scipy.stats import binomtest

    alone, other = int((first & ~second).sum()), int((second & ~first).sum())
    chance = float(binomtest(alone, alone + other).pvalue) if alone + other else 1.0
    return Discordance(int((first & second).sum()), alone, other, int((~first & ~second).sum()), chance)


def holm(chances: Sequence[float]) -> list[float]:
    """Probabilities of several tests (n,), each as small as all tests together allow: Holm's step-down correction.

    Those below 0.05 are the tests that stand where the probability that any of them errs is to be 5 % at most, however
    they depend on each other.

    Notes
    -----
    Source: Holm (1979), Scand. J. Stat. 6.
    """
    order = np.argsort(chances, kind="stable")
    left = np.arange(len(chances), 0, -1)
    corrected = np.minimum(np.maximum.accumulate(left * np.asarray(chances, dtype=float)[order]), 1.0)
    found = np.empty(len(chances))
    found[order] = corrected
    return found.tolist()


def _blocks(values: Array, seed: int) -> Array:
    """The values, or means of equally many of them, taken by chance."""
    if values.size <= BLOCKS:
        return values
    size = -(-values.size // BLOCKS)
    shuffled = np.random.default_rng(seed).permutation(values)[: values.size // size * size]
    return shuffled.reshape(-1, size).mean(axis=1)


def _mean(values: Array, axis: int = -1) -> Array:
    return np.mean(values, axis=axis)


def _difference(first: Array, second: Array, axis: int = -1) -> Array:
    return np.mean(first, axis=axis) - np.mean(second, axis=axis)


def _bootstrap(samples: tuple[Array, ...], of: Callable[..., Array], seed: int) -> tuple[float, float]:
    from scipy import stats

    resampled: Any = stats.bootstrap  # its types lack some of its arguments
    # Where nearly all values are the same, the correction is not defined, and plain percentiles are what there is.
    for method in ("BCa", "percentile"):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = resampled(
                samples,
                of,
                n_resamples=RESAMPLES,
                confidence_level=CONFIDENCE,
                method=method,
                vectorized=True,
                batch=200,
                random_state=np.random.default_rng(seed),
            ).confidence_interval
        if np.isfinite(found.low) and np.isfinite(found.high):
            break
    return float(found.low), float(found.high)
