"""The line of least curvature: within limits, better than others, and the solution of IPOPT."""

import casadi as ca
import numpy as np
import pytest
from curves import lobed
from hypothesis import given, settings
from hypothesis import strategies as st

import rumo
from rumo.references import TRACKS, Path, Track, minimum_curvature
from rumo.references.generators import circle, clothoid, straight
from rumo.references.manoeuvres import iso_3888_2


def bending(path):
    """Integral of the squared curvature [1/m]."""
    s = np.linspace(0.0, path.length, 8001)
    return np.mean(path.at(s[:-1]).curvature ** 2) * path.length


def off_track(track, path, margin):
    """How far a line is beyond the limits [m]."""
    s = np.linspace(0.0, path.length, 1000)
    there, worst, near = path.at(s), -np.inf, None
    for x, y in zip(there.x, there.y, strict=True):
        near = track.path.project((x, y), near, window=10.0)
        centre = track.path.at(near)
        aside = np.cos(centre.heading) * (y - centre.y) - np.sin(centre.heading) * (x - centre.x)
        left, right = track.limits(near)
        worst = max(worst, aside - left + margin, -aside - right + margin)
    return worst


@settings(max_examples=15, deadline=None)
@given(lobed(), st.floats(0.01, 0.1), st.floats(0.0, 0.6))
def test_a_line_stays_within_limits_and_bends_less(points, share, part):
    size = np.abs(points).max()
    path = Path(points * (100.0 / size), closed=True)
    radius = 1.0 / np.abs(path.at(path.nodes).curvature).max()
    half = min(100.0 * share, 0.8 * radius)
    track = Track(path, half, 1.5 * half)
    line = minimum_curvature(track, part * half)
    assert bending(line) <= bending(path) * (1.0 + 1e-6)
    assert off_track(track, line, part * half) < 0.02
    for other in (0.5 * half, -0.5 * half):
        beside = Path(
            path.offset(path.nodes[:-1], np.clip(other, (part - 1.0) * half, (1.0 - part) * half)), closed=True
        )
        assert bending(line) <= bending(beside) * (1.0 + 1e-3)


def menger(x, y, closed):
    """Sum of squared curvatures by lengths, each of the circle through three points."""
    n = x.shape[0]
    order = [np.arange(n), (np.arange(n) + 1) % n, (np.arange(n) + 2) % n]
    a, b, c = (i.tolist() if closed else i[: n - 2].tolist() for i in order)
    ux, uy, vx, vy = x[b] - x[a], y[b] - y[a], x[c] - x[b], y[c] - y[b]
    u, v = ca.sqrt(ux**2 + uy**2), ca.sqrt(vx**2 + vy**2)
    curvature = 2.0 * (ux * vy - uy * vx) / (u * v * ca.sqrt((ux + vx) ** 2 + (uy + vy) ** 2))
    return ca.sum1(curvature**2 * 0.5 * (u + v))


def by_ipopt(variables, cost, lower, upper):
    options = {"ipopt.print_level": 0, "print_time": False, "ipopt.sb": "yes", "ipopt.tol": 1e-10}
    solver = ca.nlpsol("line", "ipopt", {"x": variables, "f": cost}, options)
    return solver(x0=0.5 * (np.asarray(lower) + upper), lbx=lower, ubx=upper)


def test_it_costs_as_little_as_the_solution_of_a_nonlinear_program():
    """IPOPT on the oval: where bends begin is all the same to the cost, so lines may differ, but not what they cost."""
    track, n, margin = TRACKS["oval"](), 90, 1.0
    line = minimum_curvature(track, margin, spacing=track.path.length / n)
    s = np.arange(n) * track.path.length / n
    centre = track.path.at(s)
    alpha = ca.MX.sym("alpha", n)
    x, y = centre.x - alpha * np.sin(centre.heading), centre.y + alpha * np.cos(centre.heading)
    best = by_ipopt(alpha, menger(x, y, closed=True), margin - 5.0, 5.0 - margin)
    there = line.at(line.stations)
    cost = float(menger(ca.DM(there.x), ca.DM(there.y), closed=True))
    assert float(best["f"]) <= cost <= float(best["f"]) * (1.0 + 1e-3)


def test_it_is_the_solution_of_a_nonlinear_program():
    """IPOPT between the cones of ISO 3888-2, where one line is the best."""
    change = iso_3888_2(1.8)
    line = minimum_curvature(change.track(), 1.0, spacing=0.5)
    x = np.arange(-30.0, 91.01, 0.5)
    y = ca.MX.sym("y", len(x))
    right, left = change.limits(x)
    best = by_ipopt(y, menger(ca.DM(x), y, closed=False), right + 1.0, left - 1.0)["x"].toarray().ravel()
    there = line.at(np.linspace(0.0, line.length, 4000))
    between = (x > -10.0) & (x < 70.0)
    np.testing.assert_allclose(np.interp(x, there.x, there.y)[between], best[between], atol=2e-3)


def test_a_bend_is_cut_to_the_inside_and_a_straight_stays_straight():
    track = Track(clothoid(80.0, 0.03), 3.0, 3.0)
    line = minimum_curvature(track, 1.0)
    assert bending(line) < 0.8 * bending(track.path)
    assert bending(minimum_curvature(Track(straight(100.0), 3.0, 2.0))) < 1e-12
    # Around a circle, the longest way is the least bent: the integral of 1 / r^2 is 2 pi / r.
    around = minimum_curvature(Track(circle(30.0), 5.0, 4.0), 1.0)
    assert bending(around) == pytest.approx(2.0 * np.pi / 33.0, rel=1e-3)


def test_mistakes():
    track = Track(circle(30.0), 2.0, 2.0)
    with pytest.raises(rumo.ArgumentError, match=r"margin: got 2 m, which leaves 0 m at 0 m, expected less than half"):
        minimum_curvature(track, 2.0)
    with pytest.raises(rumo.ArgumentError, match=r"spacing: got 0.0, expected a positive"):
        minimum_curvature(track, spacing=0.0)
