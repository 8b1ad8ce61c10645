"""Disturbances by place: a plant meets them where it is, whatever the time."""

import pickle

import numpy as np
import pytest

import rumo
from rumo.references import TRACKS, Path, generators
from rumo.signals import Signals
from rumo.simulation import ByPlace, Patch

STRAIGHT = generators.straight(100.0)
STATES = Signals({"heat": "K", "p_x": "m", "p_y": "m"}, "states")


def drifting(speed):
    """A point that moves along a straight, and is told of what is under it."""
    model = rumo.Model(
        states={"p_x": "m", "p_y": "m"},
        inputs={"push": "m/s"},
        parameters={"mu": rumo.Parameter("1", 0.0)},
        dynamics=lambda x, u, p: {"p_x": speed + 0.0 * u.push, "p_y": 0.0 * p.mu},
    )
    problem = rumo.Problem(
        model, horizon=5, sampling_time=0.1, track={"p_x": rumo.Weight(1.0)}, moves={"push": rumo.Weight(1.0)}
    )
    return rumo.Scenario(
        problem,
        model,
        [0.0, 2.0],
        {"p_x": 0.0},
        6.0,
        backend="portable",
        disturbances={"mu": ByPlace(STRAIGHT, {0.0: 0.9, 12.0: 0.3, 20.0: 0.7})},
    )


@pytest.mark.parametrize("speed", [5.0, 10.0])
def test_a_plant_meets_it_where_it_is(speed):
    log = drifting(speed).run()
    s = speed * log["time"].to_numpy()
    expected = np.where(s < 12.0 - 1e-9, 0.9, np.where(s < 20.0 - 1e-9, 0.3, 0.7))
    near = np.minimum(np.abs(s - 12.0), np.abs(s - 20.0)) < 1e-6
    found = log["disturbance"].sel(parameter="mu").to_numpy()
    np.testing.assert_array_equal(found[~near], expected[~near])
    assert set(found) == {0.9, 0.3, 0.7}


def test_crossing_paths_are_followed_and_laps_begin_anew():
    path = TRACKS["eight"]().path
    half = 0.5 * path.length
    value = ByPlace(path, {0.0: 1.0, half: 2.0}).start(STATES)
    s = np.arange(1.0, 2.5 * path.length, 2.0)
    points = path.at(s % path.length)
    found = [value(np.array([0.0, x, y + 0.3])) for x, y in zip(points.x, points.y, strict=True)]
    # Within a metre of a change, three decimetres beside the path may be on the other side of it.
    clear = np.abs((s + 0.5 * half) % half - 0.5 * half) > 1.0
    np.testing.assert_array_equal(np.array(found)[clear], np.where(s % path.length < half, 1.0, 2.0)[clear])


def test_a_front_axle_is_there_first():
    value = ByPlace(STRAIGHT, {0.0: 0.9, 10.0: 0.3}, ahead=1.5)
    assert [value.at(8.4), value.at(8.6)] == [0.9, 0.3]
    assert pickle.loads(pickle.dumps(value)).at(8.6) == 0.3


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ByPlace(STRAIGHT, {}), "values: got none, expected a value from some arc length on"),
        (lambda: ByPlace(STRAIGHT, {0.0: np.nan}), r"values\[0.0\]: got nan, expected a finite number"),
        (lambda: ByPlace([(0.0, 0.0)], {0.0: 1.0}), "path: got .*, expected a rumo.Path"),
        (lambda: ByPlace(STRAIGHT, {0.0: 1.0}, position=("p_x",)), "position: got .*, expected two states"),
        (lambda: ByPlace(STRAIGHT, {0.0: 1.0}, position=("x", "y")).start(STATES), "position: got 'x', expected one"),
    ],
)
def test_mistakes(make, message):
    assert isinstance(STRAIGHT, Path)
    with pytest.raises(rumo.ArgumentError, match=message):
        make()


def test_a_patch_is_where_a_state_is_between_two():
    value = Patch(value=0.3, elsewhere=0.9, begin=10.0, length=5.0).start(STATES)
    found = [value(np.array([0.0, x, 2.0])) for x in (9.99, 10.0, 14.99, 15.0)]
    assert found == [0.9, 0.3, 0.3, 0.9]
    nowhere = Patch(value=0.3, elsewhere=0.9, begin=10.0, length=0.0).start(STATES)
    assert nowhere(np.array([0.0, 10.0, 0.0])) == 0.9
    by_y = Patch(value=0.3, elsewhere=0.9, begin=0.0, length=1.0, state="p_y").start(STATES)
    assert by_y(np.array([0.0, 7.0, 0.5])) == 0.3


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"length": -1.0}, "length: got -1.0"),
        ({"length": np.inf}, "length: got inf"),
        ({"value": np.nan}, "value: got nan"),
    ],
)
def test_what_a_patch_cannot_be(wrong, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        Patch(**{"value": 0.3, "elsewhere": 0.9, "begin": 0.0, "length": 1.0, **wrong})


def test_a_patch_of_an_unknown_state():
    with pytest.raises(rumo.ArgumentError, match="state: got 'p_z'"):
        Patch(0.3, 0.9, 0.0, 1.0, "p_z").start(STATES)
