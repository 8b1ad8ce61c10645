"""Paths: true arc length, continuous curvature, laps, straights beyond the ends; exact where there is a closed form."""

import pickle

import numpy as np
import pytest
from curves import lobed, moved, winding
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import ellipe, fresnel

import rumo
from rumo.references import Path

ANGLE = np.linspace(0.0, 2.0 * np.pi, 100, endpoint=False)
ELLIPSE = Path(np.column_stack([50.0 * np.cos(ANGLE), 30.0 * np.sin(ANGLE)]), closed=True)
CURVES = st.one_of(st.tuples(lobed(), st.just(True)), st.tuples(winding(), st.just(False)))


def places(path, n=500):
    """From half a lap before the beginning to half a lap beyond the end, these two not among them."""
    return np.linspace(-0.5, 1.5, n) * path.length


@settings(max_examples=40, deadline=None)
@given(CURVES)
def test_parameter_is_the_arc_length(curve):
    path = Path(*curve)
    s, step = places(path), 1e-4 * path.length
    ahead, here, behind = path.at(s + step), path.at(s), path.at(s - step)
    chord = np.hypot(ahead.x - behind.x, ahead.y - behind.y)
    # A chord is shorter than its arc by (kappa step)^2 / 6, and never longer.
    assert (chord <= 2.0 * step * (1.0 + 1e-6)).all()
    most = np.maximum(np.abs(ahead.curvature), np.abs(behind.curvature)).max()
    assert (chord >= 2.0 * step * (1.0 - 1e-6 - (most * step) ** 2 / 6.0)).all()
    # The heading is the direction of travel; curvature jumps where an open path ends.
    across = -np.sin(here.heading) * (ahead.x - behind.x) + np.cos(here.heading) * (ahead.y - behind.y)
    inside = np.full(len(s), True) if path.closed else (s > step) & (s < path.length - step)
    rate = np.abs(path.at(places(path, 4001)).curvature_rate).max()
    assert (np.abs(across)[inside] <= step * (0.4 * rate * step**2 + 1e-6)).all()


@settings(max_examples=40, deadline=None)
@given(CURVES)
def test_heading_and_curvature_are_continuous_and_derivatives_of_each_other(curve):
    path = Path(*curve)
    step = 1e-6 * path.length
    s = places(path, 1001)
    before, after = path.at(s - step), path.at(s + step)
    most = np.abs(path.at(places(path, 4001)).curvature).max() + 1.0 / path.length
    assert (np.abs(after.heading - before.heading) <= 2.5 * most * step + 1e-9).all()
    inside = np.full(len(s), True) if path.closed else (s > step) & (s < path.length - step)
    mean = 0.5 * (before.curvature + after.curvature)[inside]
    np.testing.assert_allclose((after.heading - before.heading)[inside] / (2.0 * step), mean, atol=1e-3 * most)


@settings(max_examples=30, deadline=None)
@given(CURVES)
def test_it_leads_through_its_points(curve):
    points, closed = curve
    path = Path(points, closed)
    there = path.at(path.stations)
    np.testing.assert_allclose(np.column_stack([there.x, there.y]), points, atol=1e-7 * np.abs(points).max())
    assert path.stations[0] == 0.0
    assert (np.diff(path.stations) > 0.0).all()


@settings(max_examples=30, deadline=None)
@given(lobed())
def test_closed_paths_begin_again_lap_after_lap(points):
    path = Path(points, closed=True)
    s = places(path)
    here, next_lap = path.at(s), path.at(s + path.length)
    assert abs(path.turning) == 2.0 * np.pi
    scale = np.abs(points).max()
    for name in ("x", "y", "curvature"):
        size = scale if name != "curvature" else 1.0 / scale
        np.testing.assert_allclose(getattr(next_lap, name), getattr(here, name), atol=1e-6 * size)
    np.testing.assert_allclose(next_lap.heading - here.heading, path.turning, atol=1e-6)


@settings(max_examples=30, deadline=None)
@given(winding())
def test_open_paths_go_on_straight(points):
    path = Path(points)
    reach = np.array([0.0, 0.5, 3.0]) * path.length
    for s, sign in ((-reach, -1.0), (path.length + reach, 1.0)):
        beyond = path.at(s)
        np.testing.assert_array_equal(beyond.heading, beyond.heading[0])
        assert not beyond.curvature[1:].any()
        legs = np.column_stack([beyond.x - beyond.x[0], beyond.y - beyond.y[0]])
        along = np.array([np.cos(beyond.heading[0]), np.sin(beyond.heading[0])])
        np.testing.assert_allclose(legs, sign * np.outer(reach, along), atol=1e-9 * path.length)


@settings(max_examples=30, deadline=None)
@given(CURVES, st.floats(-3.0, 3.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_a_path_that_is_turned_and_shifted_is_the_same_elsewhere(curve, angle, right, up):
    points, closed = curve
    size = np.abs(points).max()
    shift = size * np.array([right, up])
    path, other = Path(points, closed), Path(moved(points, angle, shift), closed)
    assert other.length == pytest.approx(path.length, rel=1e-9)
    s = places(path)
    here, there = path.at(s), other.at(s)
    np.testing.assert_allclose(
        np.column_stack([there.x, there.y]), moved(np.column_stack([here.x, here.y]), angle, shift), atol=1e-6 * size
    )
    turned = there.heading - here.heading - angle
    np.testing.assert_allclose(turned, 2.0 * np.pi * np.round(turned[0] / (2.0 * np.pi)), atol=1e-6)
    np.testing.assert_allclose(
        there.curvature, here.curvature, atol=1e-4 / size * (1.0 + np.abs(size * here.curvature).max())
    )


def test_an_ellipse_is_as_long_and_as_bent_as_it_is():
    assert ELLIPSE.length == pytest.approx(4.0 * 50.0 * ellipe(1.0 - 0.36), rel=1e-6)
    start, top = ELLIPSE.at(0.0), ELLIPSE.at(0.25 * ELLIPSE.length)
    assert start.curvature == pytest.approx(50.0 / 30.0**2, rel=3e-3)
    assert top.curvature == pytest.approx(30.0 / 50.0**2, rel=3e-3)
    assert top.heading - start.heading == pytest.approx(0.5 * np.pi, abs=1e-5)


def test_the_curvature_of_a_spline_converges_with_the_square_of_the_spacing():
    errors = []
    for n in (50, 100, 200):
        angle = np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)
        path = Path(np.column_stack([np.cos(angle), np.sin(angle)]), closed=True)
        errors.append(np.abs(path.at(places(path)).curvature - 1.0).max())
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders == pytest.approx(2.0, abs=0.2)


def test_clothoids_by_their_curvature():
    a = 15.0
    path = Path.from_curvature((2.0, 42.0), (0.0, 40.0 / a**2), start=(3.0, -1.0, 0.0))
    s = np.linspace(0.0, 40.0, 401)
    y, x = (a * np.sqrt(np.pi) * part for part in fresnel(s / (a * np.sqrt(np.pi))))
    there = path.at(s)
    np.testing.assert_allclose(there.x, 3.0 + x, atol=1e-9)
    np.testing.assert_allclose(there.y, -1.0 + y, atol=1e-9)
    np.testing.assert_allclose(there.curvature, s / a**2, atol=1e-12)
    np.testing.assert_allclose(there.curvature_rate[1:-1], 1.0 / a**2, rtol=1e-6)


def test_smoothing_passes_points_at_their_noise():
    rng = np.random.default_rng(0)
    exact = np.column_stack([80.0 * np.cos(ANGLE), 80.0 * np.sin(ANGLE)])
    noisy = exact + rng.normal(0.0, 0.1, exact.shape)
    rough, smooth = Path(noisy, closed=True), Path(noisy, closed=True, smoothing=0.1 * np.sqrt(2.0))
    s = np.linspace(0.0, smooth.length, 1000)
    error = [np.abs(path.at(s).curvature - 1.0 / 80.0).max() for path in (rough, smooth)]
    assert error[1] < 0.2 * error[0]
    passed = smooth.at(smooth.stations)
    distance = np.sqrt(np.mean((passed.x - noisy[:, 0]) ** 2 + (passed.y - noisy[:, 1]) ** 2))
    assert distance == pytest.approx(0.1 * np.sqrt(2.0), rel=0.1)
    assert abs(smooth.turning) == 2.0 * np.pi


def test_the_first_point_may_stand_at_the_end_again():
    points = np.array([(0.0, 0.0), (10.0, 0.0), (10.0, 8.0), (0.0, 8.0)])
    again = Path(np.vstack([points, points[:1]]), closed=True)
    assert again.length == Path(points, closed=True).length
    assert len(again.stations) == 4


def test_two_points_are_a_straight():
    path = Path([(1.0, 1.0), (4.0, 5.0)])
    assert path.length == pytest.approx(5.0)
    assert path.at(2.5).x == pytest.approx(2.5)
    assert path.at(np.full((2, 3), 2.5)).heading.shape == (2, 3)


def test_paths_can_be_sent_away():
    other = pickle.loads(pickle.dumps(ELLIPSE))
    np.testing.assert_array_equal(other.at(places(other)), ELLIPSE.at(places(ELLIPSE)))
    assert other.project((60.0, 1.0)) == ELLIPSE.project((60.0, 1.0))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Path([(0.0, 0.0)]), "points: got 1, expected at least 2 of an open path."),
        (lambda: Path([(0.0, 0.0), (1.0, 0.0)], True), "points: got 2, expected at least 3 of a closed path."),
        (lambda: Path([(0.0, 0.0, 1.0)] * 4), r"points: got shape \(4, 3\), expected shape \(n, 2\): x and y \[m\]"),
        (lambda: Path([(0.0, 0.0), (1.0, np.nan)]), r"points\[1\]: got \[1.0, nan\], expected finite numbers"),
        (
            lambda: Path([(0.0, 0.0), (1.0, 0.0), (1.0, 0.0)]),
            r"points\[2\]: got \[1.0, 0.0\], as the point before, .*Leave",
        ),
        (lambda: Path("track.csv"), "points: got 'track.csv', expected numbers"),
        (
            lambda: Path([(0.0, 0.0), (1.0, 0.0), (0.0, 0.0)]),
            "points: got a turn on the spot .* A sharp turn needs more",
        ),
        (lambda: Path([(0.0, 0.0), (1.0, 0.0)], closed="yes"), "closed: got 'yes', expected True or False"),
        (
            lambda: Path([(0.0, 0.0), (1.0, 0.0)], smoothing=-1.0),
            "smoothing: got -1.0, expected a number of at least 0",
        ),
        (lambda: Path([(0.0, 0.0), (1.0, 0.0)], smoothing=np.inf), "smoothing: got inf, expected a finite distance"),
        (
            lambda: Path.from_curvature((0.0, 9.0), (0.1, 0.1), closed=True),
            "closed: got a path that ends .* expected one",
        ),
        (lambda: Path.from_curvature((0.0, 0.0), (0.1, 0.1)), "stations: got .* expected at least two arc lengths"),
        (lambda: ELLIPSE.project((1.0, 2.0, 3.0)), r"point: got shape \(3,\), expected shape \(2,\): x and y"),
        (lambda: ELLIPSE.project((1.0, 2.0), np.nan), "near: got nan, expected a finite number"),
        (lambda: ELLIPSE.project((1.0, 2.0), 0.0, window=0.0), "window: got 0.0, expected a positive finite number"),
    ],
)
def test_mistakes(make, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        make()
