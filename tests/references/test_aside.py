"""A track seen from another line along it."""

import numpy as np
import pytest

import rumo
from rumo.references import TRACKS, Path, Track, generators, manoeuvres, minimum_curvature


def test_about_its_own_line_it_is_the_same():
    track = Track(generators.circle(30.0), 4.0, 3.0)
    s = np.linspace(0.0, 180.0, 37)
    for found, width in zip(track.about(track.path).limits(s), (4.0, 3.0), strict=True):
        np.testing.assert_allclose(found, width, atol=1e-3)


def test_a_circle_about_one_that_is_larger():
    inner = Track(generators.circle(30.0), 4.0, 6.0)
    outer = generators.circle(33.0)  # both begin at the origin, heading along x: the same centre 3 m higher
    moved = inner.about(outer)
    # Edges are circles of 26 and 36 m about (0, 30), normals those of a circle about (0, 33).
    for s in np.linspace(0.0, outer.length, 9):
        for side, (width, radius) in enumerate(zip(moved.limits(s), (26.0, 36.0), strict=True)):
            x, y = outer.offset(s, -width if side else width)
            assert np.hypot(x, y - 30.0) == pytest.approx(radius, abs=2e-2)


@pytest.mark.parametrize("name", TRACKS)
def test_edges_are_where_they_were(name):
    track = TRACKS[name]()
    line = minimum_curvature(track, 1.5)
    about = track.about(line)
    s = np.linspace(0.0, line.length, 60, endpoint=False)
    for side, edge in enumerate(about.edges(s)):
        for place, at in zip(s, edge, strict=True):
            here = line.at(place)
            own = track.path.project((here.x, here.y), heading=float(here.heading))
            there = track.path.project(at, own, window=20.0)
            aside = float(track.path.at(there).left(*at))
            assert (aside, -aside)[side] == pytest.approx(float(track.limits(there)[side]), abs=0.02)
    left, right = about.limits(s)
    assert min(left.min(), right.min()) > 1.45  # the line keeps its margin


def test_lanes_about_a_line_through_them():
    change = manoeuvres.iso_3888_2(1.8)
    line = change.path(0.1)
    about = change.track().about(line, 0.25)
    s = np.linspace(0.0, line.length, 200)
    left, right = about.limits(s)
    assert left.min() > 0.9
    assert right.min() > 0.9


def test_a_line_somewhere_else_is_refused():
    with pytest.raises(rumo.ArgumentError, match="no edge is found"):
        TRACKS["oval"]().about(Path([(0.0, 900.0), (50.0, 900.0), (100.0, 900.0)]))
