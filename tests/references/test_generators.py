"""Paths by their shape, tracks by name, and manoeuvres by their standard."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rumo
from rumo.references import TRACKS, Path, Track
from rumo.references.generators import (
    Bend,
    bends,
    circle,
    closing,
    clothoid,
    cones_of_slalom,
    figure_of_eight,
    sine,
    slalom,
    straight,
)
from rumo.references.manoeuvres import SineWithDwell, StepSteer, iso_3888_1, iso_3888_2

WIDTHS = st.floats(1.0, 2.6)


def test_circles_go_round():
    for left in (True, False):
        path = circle(20.0, left=left)
        assert path.length == pytest.approx(40.0 * np.pi)
        assert path.turning == (1.0 if left else -1.0) * 2.0 * np.pi
        there = path.at(np.linspace(0.0, path.length, 100))
        np.testing.assert_allclose(np.hypot(there.x, there.y - (20.0 if left else -20.0)), 20.0, rtol=1e-9)


def test_bends_turn_by_their_angle():
    path = bends([10.0, Bend(15.0, 1.2, 5.0), straight(7.0).length])
    end = path.at(path.length)
    assert end.heading == pytest.approx(1.2)
    assert path.length == pytest.approx(10.0 + 15.0 * 1.2 + 5.0 + 7.0)
    assert path.at(np.linspace(0.0, path.length, 500)).curvature.max() == pytest.approx(1.0 / 15.0)
    assert clothoid(20.0, 0.1).at(20.0).heading == pytest.approx(1.0)


@settings(max_examples=20, deadline=None)
@given(st.floats(15.0, 80.0), st.floats(0.05, 0.3), st.floats(0.3, 2.5))
def test_eights_cross_themselves_where_they_begin(radius, share, crossing):
    path = figure_of_eight(radius, share * radius, crossing)
    first, second = path.at(0.0), path.at(0.5 * path.length)
    assert np.hypot(second.x - first.x, second.y - first.y) < 1e-6 * path.length
    turn = (second.heading - first.heading) % (2.0 * np.pi)
    assert min(turn, 2.0 * np.pi - turn) == pytest.approx(np.pi - crossing, abs=1e-6)
    assert path.turning == 0.0


@pytest.mark.parametrize("name", TRACKS)
def test_tracks_close_smoothly(name):
    track = TRACKS[name]()
    s = np.linspace(-0.1, 0.1, 11)
    there = track.path.at(s)
    np.testing.assert_allclose(there.curvature, 0.0, atol=1e-9)
    np.testing.assert_allclose(np.diff(np.hypot(there.x - there.x[0], there.y - there.y[0])), 0.02, rtol=1e-5)
    left, right = track.edges(np.linspace(0.0, track.path.length, 400))
    across = np.linalg.norm(left - right, axis=1)
    np.testing.assert_allclose(across, across[0])
    assert track.name == name


def test_a_circuit_has_what_it_says():
    path = TRACKS["club"]().path
    assert 1900.0 < path.length < 2400.0
    assert path.at(np.linspace(0.0, path.length, 5000)).curvature.max() == pytest.approx(1.0 / 13.0)


def test_waves():
    path = sine(3.0, 60.0, 2)
    there = path.at(np.linspace(0.0, path.length, 500))
    np.testing.assert_allclose(there.y, 3.0 * np.sin(2.0 * np.pi * there.x / 60.0), atol=1e-6)
    line, cones = slalom(18.0, 1.6, 6, 30.0), cones_of_slalom(18.0, 6, 30.0)
    passed = [line.at(line.project(cone)).y for cone in cones]
    assert (np.sign(passed) == [1, -1, 1, -1, 1, -1]).all()
    assert np.abs(line.at(line.length).y) < 1e-9


@settings(max_examples=10, deadline=None)
@given(WIDTHS, st.sampled_from([iso_3888_1, iso_3888_2]), st.floats(0.0, 0.04))
def test_a_line_through_the_cones_touches_none(width, manoeuvre, margin):
    change = manoeuvre(width)
    path = change.path(margin)
    there = path.at(np.linspace(0.0, path.length, 4000))
    for lane in change.lanes:
        within = (there.x >= lane.begin) & (there.x <= lane.end)
        assert (there.y[within] - lane.right >= 0.5 * width + margin - 2e-3).all()
        assert (lane.left - there.y[within] >= 0.5 * width + margin - 2e-3).all()
    right, left = change.limits(there.x)
    assert ((right < there.y) & (there.y < left)).all()
    # A line of least curvature has a curvature of straight pieces between the cones that it touches.
    assert np.abs(there.curvature).max() < 0.08
    assert np.abs(np.diff(there.curvature)).max() < 0.01


def test_obstacle_avoidance_as_in_the_standard():
    change = iso_3888_2(1.4)
    first, middle, last = change.lanes
    centres = [0.5 * (lane.right + lane.left) for lane in change.lanes]
    assert centres[1] - centres[0] == pytest.approx(3.09, abs=0.01)
    assert change.length == 61.0
    assert [lane.left - lane.right for lane in change.lanes] == pytest.approx([1.79, 2.4, 3.0])
    assert (first.end, middle.begin, middle.end, last.begin) == (12.0, 25.5, 36.5, 49.0)
    assert first.left == pytest.approx(last.left)
    assert middle.right - first.left == pytest.approx(1.0)
    assert len(change.cones()) == 2 * (5 + 5 + 5)


def test_severe_lane_change_as_in_the_standard():
    change = iso_3888_1(1.8)
    assert change.length == 125.0
    assert [lane.left - lane.right for lane in change.lanes] == pytest.approx([2.23, 2.41, 2.59])
    assert change.lanes[1].right - change.lanes[0].right == pytest.approx(3.5)
    track = change.track()
    left, right = track.limits(np.array([35.0, 60.0, 80.0]))
    np.testing.assert_allclose(left, [1.115, 4.795, 4.795])
    np.testing.assert_allclose(-right, [-1.115, -1.115, 2.385])


def test_steering_inputs():
    t = np.linspace(0.0, 5.0, 50001)
    step = StepSteer(-0.1, rate=0.5)(t)["delta"]
    assert step[t <= 1.0].tolist() == [0.0] * (t <= 1.0).sum()
    assert step[t >= 1.2001].max() == -0.1
    assert np.abs(np.diff(step)).max() <= 0.5 * t[1] * (1.0 + 1e-6)
    manoeuvre = SineWithDwell(0.08)
    delta = manoeuvre(t)["delta"]
    assert (delta <= -0.08 + 1e-9).sum() * t[1] == pytest.approx(0.5, abs=1e-3)
    assert np.abs(np.diff(delta)).max() < 0.08 * 2.0 * np.pi * 0.7 * t[1] * 1.01
    assert not delta[(t < 1.0) | (t > manoeuvre.end)].any()
    assert manoeuvre.end == pytest.approx(1.0 + 1.0 / 0.7 + 0.5)


LINE = Path([(0.0, 0.0), (10.0, 0.0), (20.0, 0.0)])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: circle(0.0), "radius: got 0.0, expected a positive finite number"),
        (lambda: Bend(10.0, 0.3, 4.0), "clothoid: got 4.0, expected less than 3 m, which is all of the turn"),
        (lambda: bends([]), r"segments: got \[\], expected lengths and bends"),
        (lambda: bends([3.0, -1.0]), r"segments\[1\]: got -1.0, expected a positive finite number"),
        (lambda: bends([3.0, Bend(5.0, 1.0, 1.0)], closed=True), "closed: got a path that ends"),
        (lambda: closing([3.0, Bend(5.0, 3.0, 1.0), 4.0, 5.0], 2, 3), "first, second: got 2, 3, which are parallel"),
        (lambda: figure_of_eight(crossing=4.0), "crossing: got 4.0, expected less than half a turn"),
        (lambda: slalom(approach=5.0), "approach: got 5.0, expected at least the spacing of 18 m"),
        (lambda: iso_3888_2(1.8).path(0.5), "margin: got 1.4 m, which leaves -0.57 m at .*less than half the track"),
        (lambda: iso_3888_1(-1.8), "width: got -1.8, expected a positive finite number"),
        (lambda: StepSteer(0.1, rate=0.0), "rate: got 0.0, expected a positive"),
        (lambda: Track(LINE, 5.0, -5.0), r"width_left \+ width_right: got 0 m at 0 m, expected more than 0"),
        (lambda: Track(LINE, [5.0, 5.0], 5.0), r"width_left: got shape \(2,\), expected a number, or shape \(3,\)"),
        (lambda: Track(LINE, 5.0, [5.0, np.nan, 5.0]), "width_right: got NaN or infinity, expected finite widths"),
        (lambda: Track("monza", 5.0, 5.0), "path: got 'monza', expected a rumo.Path"),
    ],
)
def test_mistakes(make, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        make()
