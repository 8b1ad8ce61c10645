"""The room beside the ends of a car on a track: the least width near them, wherever it is known from."""

import numpy as np
import pytest

from rumo.references import Path, Track
from rumo.vehicles import PAPER_CAR

ANGLE = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
PATHS = {
    "closed": Path(np.column_stack([50.0 * np.cos(ANGLE), 30.0 * np.sin(ANGLE)]), closed=True),
    "open": Path(np.column_stack([np.arange(0.0, 200.0, 4.0), 5.0 * np.sin(np.arange(50.0) / 8.0)])),
}
every_path = pytest.mark.parametrize("path", PATHS.values(), ids=PATHS)


def least(track, side, ahead, s):
    """The least width around what is `ahead`, at distances up to a quarter of the car's length."""
    front, rear = PAPER_CAR.ends
    near = ahead + 0.25 * (front - rear) * np.linspace(-1.0, 1.0, 5)
    return track.limits(s[:, None] + near)[side].min(axis=1)


def check(track, atol=1e-12):
    s = np.linspace(-0.7, 1.7, 3001) * track.path.length
    room, (front, rear) = track.room(PAPER_CAR), PAPER_CAR.ends
    assert set(room) == {"front_left", "front_right", "rear_left", "rear_right"}
    for name, ahead in (("front", front), ("rear", rear)):
        for side, where in enumerate(("left", "right")):
            expected = least(track, side, ahead, s)
            found = np.broadcast_to(room[f"{name}_{where}"](s), s.shape)
            np.testing.assert_allclose(found, expected, rtol=0.0, atol=atol)


@every_path
def test_widths_at_stations(path):
    rng = np.random.default_rng(1)
    check(Track(path, *rng.uniform(2.0, 5.0, (2, len(path.stations)))))


@pytest.mark.parametrize("spacing", [1.0, 0.1])
def test_stations_closer_than_a_car_is_long_also_where_a_lap_begins(spacing):
    s = np.arange(0.0, 2.0 * np.pi * 20.0, spacing)
    path = Path(20.0 * np.column_stack([np.cos(s / 20.0), np.sin(s / 20.0)]), closed=True)
    rng = np.random.default_rng(3)
    # Lines of slopes up to 10 cross where rounding of arc lengths of 100 m leaves them.
    check(Track(path, *rng.uniform(3.0, 4.0, (2, len(path.stations)))), atol=1e-9)


@every_path
def test_widths_that_are_functions_or_the_same_everywhere(path):
    check(Track(path, lambda s: 4.0 + np.cos(s), 3.0))


@every_path
def test_widths_are_those_at_the_stations_and_straight_between(path):
    widths = np.random.default_rng(2).uniform(2.0, 5.0, len(path.stations))
    track = Track(path, widths, 3.0)
    np.testing.assert_allclose(track.limits(path.stations)[0], widths, rtol=1e-14)
    s = np.linspace(-0.7, 1.7, 1000) * path.length
    period = path.length if path.closed else None
    expected = np.interp(s, path.stations, widths, period=period)
    np.testing.assert_allclose(track.limits(s)[0], expected, rtol=0.0, atol=1e-11)
