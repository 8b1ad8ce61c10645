"""The nearest point of a path: of all of it, or near a place, where it crosses itself and far from it too."""

import numpy as np
import pytest
from curves import lobed, winding
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from rumo.references import Path

CURVES = st.one_of(st.tuples(lobed(), st.just(True)), st.tuples(winding(), st.just(False)))
T = np.linspace(0.0, 2.0 * np.pi, 120, endpoint=False)
EIGHT = Path(np.column_stack([60.0 * np.sin(T), 30.0 * np.sin(2.0 * T)]), closed=True)
"""It crosses itself at the origin, at 0 and at half its length."""


@settings(max_examples=60, deadline=None)
@given(CURVES, st.floats(0.0, 1.0), st.floats(-0.8, 0.8), st.integers(-3, 3), st.floats(-0.02, 0.02))
def test_a_place_beside_the_path_is_found_again(curve, share, sideways, lap, off):
    path = Path(*curve)
    s = (share + (lap if path.closed else 0)) * path.length
    window = 0.03 * path.length
    near = path.at(s + np.linspace(-2.0 * window, 2.0 * window, 200))
    radius = 1.0 / max(np.abs(near.curvature).max(), 1.0 / path.length)
    d = sideways * radius
    found = path.project(path.offset(s, d), near=s + off * path.length, window=window)
    # Where a path is nearly as bent as the place is far away, its distance is flat.
    assert found == pytest.approx(s, abs=1e-6 * path.length)
    assert np.linalg.norm(path.offset(found, 0.0) - path.offset(s, d)) == pytest.approx(abs(d), abs=1e-7 * path.length)


@settings(max_examples=40, deadline=None)
@given(CURVES, st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
def test_no_point_of_all_is_nearer(curve, right, up):
    points, closed = curve
    path = Path(points, closed)
    place = np.mean(points, axis=0) + np.array([right, up]) * np.ptp(points, axis=0).max()
    found = path.project(place)
    distance = np.linalg.norm(path.offset(found, 0.0) - place)
    s = np.linspace(0.0, path.length, 4001)
    nearest = np.linalg.norm(path.offset(s, 0.0 * s) - place, axis=1).min()
    # Of places as near as that to a hair, any will do: the nearest node decides.
    assert distance <= np.hypot(nearest, np.diff(path.nodes).max())
    assert not closed or 0.0 <= found < path.length


@settings(max_examples=40, deadline=None)
@given(CURVES, st.floats(0.0, 1.0), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(0.01, 0.6))
def test_no_point_within_the_window_is_nearer(curve, share, right, up, width):
    points, closed = curve
    path = Path(points, closed)
    place = np.mean(points, axis=0) + np.array([right, up]) * np.ptp(points, axis=0).max()
    near, window = share * path.length, width * path.length
    found = path.project(place, near=near, window=window)
    reach = min(window, 0.5 * path.length) if closed else window
    assert near - reach - 1e-9 <= found <= near + reach + 1e-9
    s = np.linspace(near - reach, near + reach, 4001)
    nearest = np.linalg.norm(path.offset(s, 0.0 * s) - place, axis=1).min()
    # Places on the straight beyond an end are looked at where that end is the nearest of the path itself.
    if closed or (s[0] >= 0.0 and s[-1] <= path.length):
        distance = np.linalg.norm(path.offset(found, 0.0) - place)
        assert distance <= np.hypot(nearest, np.diff(path.nodes).max())


def test_it_agrees_with_a_library():
    place = np.array([35.0, -3.0])
    start = EIGHT.project(place)
    found = minimize_scalar(
        lambda s: np.sum((EIGHT.offset(s, 0.0) - place) ** 2),
        bounds=(start - 2.0, start + 2.0),
        options={"xatol": 1e-10},
    )
    assert start == pytest.approx(found.x, abs=1e-6)


def test_a_crossing_is_passed_on_the_own_branch():
    s, found = np.arange(0.0, 3.0 * EIGHT.length, 1.7), 0.0
    rng = np.random.default_rng(1)
    for place in s:
        found = EIGHT.project(EIGHT.offset(place, rng.uniform(-2.0, 2.0)), near=found + 1.7, window=5.0)
        assert found == pytest.approx(place, abs=1e-6)
    assert EIGHT.turning == 0.0


def test_headings_decide_at_a_crossing():
    for s in (0.0, 0.5 * EIGHT.length):
        heading = float(EIGHT.at(s).heading)
        for aside in (-0.5, 0.0, 0.5):
            found = EIGHT.project(EIGHT.offset(s, aside), heading=heading + 0.3 + 4.0 * np.pi)
            assert (found - s + 1.0) % EIGHT.length - 1.0 == pytest.approx(0.0, abs=1e-6)


def test_beyond_the_ends_of_an_open_path():
    path = Path([(0.0, 0.0), (5.0, 0.0), (10.0, 0.0)])
    for near in (None, -40.0):
        assert path.project((-40.0, 3.0), near) == pytest.approx(-40.0)
    for near in (None, 47.0):
        assert path.project((50.0, -3.0), near) == pytest.approx(50.0)
    assert path.project((50.0, 1.0), near=20.0, window=5.0) == pytest.approx(25.0)


def test_a_place_that_is_no_place():
    assert np.isnan(EIGHT.project((np.nan, 1.0)))
    assert np.isnan(EIGHT.project((np.inf, 1.0), near=3.0))
