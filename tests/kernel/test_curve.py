"""Curves in pieces from the core: SciPy's values, lap after lap, and points that no other is nearer than."""

import copy
import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline, PPoly

from rumo.kernel import Curve

SEEDS = st.integers(0, 2**32 - 1)


def drawn(seed):
    """Polynomials of some order on pieces of any length, and a random generator; all of them end at a power of 2."""
    rng = np.random.default_rng(seed)
    order, count, values = rng.integers(1, 8), rng.integers(1, 60), rng.integers(1, 7)
    breaks = np.r_[0.0, np.cumsum(rng.uniform(0.01, 5.0, count))]
    end = 2.0 ** rng.integers(0, 8)
    breaks = np.r_[breaks[:-1] * (end / breaks[-1]), end]
    return PPoly(rng.normal(size=(order, count, values)), breaks), rng


def assert_like(pieces, values, s):
    """Values (n, ...) are those at s to a few units in the last place of what they are sums of."""
    piece = np.clip(np.searchsorted(pieces.x, s, side="right") - 1, 0, len(pieces.x) - 2)
    distance = np.abs(s - pieces.x[piece])[:, None]
    size = sum(np.abs(c[piece]) * distance**k for k, c in enumerate(pieces.c[::-1]))
    assert (np.abs(values.T - pieces(s)) <= 20.0 * np.finfo(float).eps * size).all()


@settings(max_examples=100, deadline=None)
@given(SEEDS)
def test_values_are_those_of_scipy(seed):
    pieces, rng = drawn(seed)
    end = pieces.x[-1]
    s = np.r_[rng.uniform(-end, 2.0 * end, 100), np.sort(rng.uniform(0.0, end, 100)), pieces.x]
    assert_like(pieces, Curve(pieces.x, pieces.c)(s), s)


@settings(max_examples=60, deadline=None)
@given(SEEDS)
def test_a_closed_curve_begins_again(seed):
    pieces, rng = drawn(seed)
    end, shift = pieces.x[-1], rng.normal(size=pieces.c.shape[2])
    curve = Curve(pieces.x, pieces.c, shift)
    # In steps that laps are multiples of, so that nothing is rounded.
    s, laps = np.floor(rng.random(100) * 2.0**20) * end / 2.0**20, rng.integers(-(2**20), 2**20, 100)
    assert_like(pieces, curve(s), s)
    grown = np.outer(shift, laps)
    np.testing.assert_allclose(curve(s + laps * end), curve(s) + grown, rtol=1e-15, atol=1e-15 * np.abs(grown).max())


@settings(max_examples=60, deadline=None)
@example(530, True)  # farther in the middle than at either end
@given(SEEDS, st.booleans())
def test_no_point_between_the_neighbours_of_the_nearest_node_is_nearer(seed, closed):
    rng = np.random.default_rng(seed)
    angle = np.linspace(0.0, 2.0 * np.pi, int(rng.integers(20, 200)) + 1)
    radius = 1.0 + 0.05 * np.cos(2.0 * angle + rng.uniform(0.0, 6.0))
    points = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    pieces = CubicSpline(angle, np.vstack([points[:-1], points[:1]]), bc_type="periodic")
    curve = Curve(pieces.x, pieces.c, np.zeros(2) if closed else None)
    nodes = np.r_[angle, angle[1:] + angle[-1]] if closed else angle[1:-1]

    def distance(s, place):
        x, y = curve(s)
        return np.hypot(x - place[0], y - place[1])

    for place in rng.uniform(-2.0, 2.0, (10, 2)):
        low = rng.uniform(0.0, 2.0 * np.pi)
        high = low + rng.uniform(0.0, 3.0 if closed else 2.0 * np.pi - low)
        found = curve.nearest(*place, low, high)
        assert low <= found <= high
        within = nodes[(low < nodes) & (nodes <= high)]
        between = np.r_[low, within, high]
        if len(within):
            i = int(distance(within, place).argmin())
            between = between[i : i + 3]
        samples = np.linspace(between[0], between[-1], 401)
        assert distance(found, place) <= distance(samples, place).min() + 2e-9  # where it ends


SQUARE = np.array([[[1.0, 1.0], [-1.0, 2.0]], [[0.0, 1.0], [1.0, 3.0]]])


def open_or_closed(closed):
    return Curve(np.array([0.0, 1.0, 3.0]), SQUARE, np.zeros(2) if closed else None)


@pytest.fixture(params=[False, True], ids=["open", "closed"])
def curve(request):
    return open_or_closed(request.param)


@pytest.mark.parametrize("shape", [(), (1,), (0,), (2, 3), (2, 0, 3)])
def test_arguments_of_any_shape(curve, shape):
    assert curve(np.full(shape, 0.5)).shape == (2, *shape)
    assert (curve(np.full(shape, 0.5)) == curve(0.5).reshape(2, *(1,) * len(shape))).all()


def test_arguments_that_lie_anywhere_in_memory(curve):
    s = np.linspace(-1.0, 4.0, 12)
    for other in (s[::-1], s[::2], s.reshape(3, 4).T, s.astype(">f8"), s.astype(np.float32), s.tolist()):
        expected = [curve(float(value)) for value in np.ravel(other)]
        np.testing.assert_array_equal(curve(other), np.transpose(expected).reshape(2, *np.shape(other)))


def test_numbers_that_are_none_lead_nowhere(curve):
    nowhere = (np.nan, np.inf, -np.inf)
    assert np.isnan(curve(nowhere)).all()
    for bad in nowhere:
        for at in range(4):
            assert np.isnan(curve.nearest(*(bad if i == at else float(i) for i in range(4))))
    assert np.isnan(curve.nearest(0.0, 0.0, 2.0, 1.0))


def test_arguments_as_far_as_numbers_go():
    far = np.array([1e18, 1e300, -1e300, 1e308])
    assert np.isfinite(open_or_closed(True)(far)).all()
    np.testing.assert_array_equal(open_or_closed(False)(far)[0], [-1e18, -1e300, -1e300, -1e308])
    for curve in map(open_or_closed, (False, True)):
        for low, high in ((-1e308, 1e308), (1e18, 1e18 + 1e3), (-1e300, 0.0), (1e308, 1.7e308)):
            assert low <= curve.nearest(0.5, 1.0, low, high) <= high


@pytest.mark.parametrize(
    "way", [lambda thing: pickle.loads(pickle.dumps(thing)), copy.deepcopy], ids=["pickle", "copy"]
)
def test_it_can_be_sent_away(way, curve):
    s = np.linspace(-5.0, 5.0, 100)
    np.testing.assert_array_equal(way(way(curve))(s), curve(s))
    assert way(curve).nearest(0.4, 1.0, -1.0, 1.0) == curve.nearest(0.4, 1.0, -1.0, 1.0)


def test_what_it_was_made_of_may_change():
    breaks, coefficients, shift = np.array([0.0, 1.0, 3.0]), SQUARE.copy(), np.zeros(2)
    curve = Curve(breaks, coefficients, shift)
    before = curve(0.5)
    breaks[:], coefficients[:], shift[:] = np.nan, np.nan, np.nan
    np.testing.assert_array_equal(curve(0.5), before)


def test_threads_share_a_curve(curve):
    s = np.linspace(-50.0, 50.0, 20_000)
    with ThreadPoolExecutor(4) as threads:
        for values in threads.map(curve, [s] * 40):
            np.testing.assert_array_equal(values, curve(s))


@pytest.mark.parametrize(
    "make",
    [
        lambda: Curve(np.arange(3.0), np.ones((2, 3, 2))),
        lambda: Curve(np.arange(3.0), np.ones((2, 2, 2)), np.zeros(3)),
        lambda: Curve(np.arange(3.0), np.ones((2, 2, 0))),
        lambda: Curve(np.arange(3.0), np.ones((2, 2, 1))).nearest(0.0, 0.0, 0.0, 1.0),
        lambda: Curve(np.arange(1.0), np.ones((2, 0, 2))),
        lambda: open_or_closed(False).when(1.0),
    ],
)
def test_what_is_no_curve(make):
    with pytest.raises(ValueError, match=r"expected \d+ doubles|a curve has|a motion has|a position has"):
        make()
