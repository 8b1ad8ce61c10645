"""Draws of a campaign: distributed as they say, spread evenly, and the same whenever they are asked for."""

from math import inf

import numpy as np
import pytest
from scipy import stats

import rumo
from rumo.campaigns.specification.distributions import (
    DISTRIBUTIONS,
    Choice,
    Integers,
    LogNormal,
    LogUniform,
    Normal,
    Triangular,
    Uniform,
    distribution_of,
)
from rumo.campaigns.specification.sampling import SAMPLINGS, Draws, Grid

ORACLES = {
    Uniform(2.0, 5.0): stats.uniform(2.0, 3.0),
    LogUniform(0.01, 10.0): stats.loguniform(0.01, 10.0),
    Normal(3.0, 2.0): stats.norm(3.0, 2.0),
    Normal(3.0, 2.0, 2.0, 4.0): stats.truncnorm(-0.5, 0.5, 3.0, 2.0),
    Normal(3.0, 2.0, low=2.0): stats.truncnorm(-0.5, inf, 3.0, 2.0),
    LogNormal(4.0, 0.3): stats.lognorm(0.3, scale=4.0),
    Triangular(1.0, 2.0, 4.0): stats.triang(1.0 / 3.0, 1.0, 3.0),
    Integers(3, 7): stats.randint(3, 8),
}


@pytest.mark.parametrize("sampling", ["sobol", "latin-hypercube", "random"])
@pytest.mark.parametrize("distribution", ORACLES, ids=repr)
def test_draws_are_distributed_as_they_say(distribution, sampling):
    draws = Draws({"a": distribution, "b": Uniform(0.0, 1.0)}, 1000, sampling, seed=1)
    values = np.array([draws[i]["a"] for i in range(1000)])
    oracle = ORACLES[distribution]
    worst = max(abs(np.mean(values <= x) - oracle.cdf(x)) for x in np.unique(values)[::7])
    assert worst < (0.05 if sampling == "random" else 0.006)
    low, high = oracle.support()
    assert (values >= low).all()
    assert (values <= high).all()


def test_choices_have_their_weights():
    draws = Draws({"a": Choice(["x", "y", {"kind": "Gust"}], [1.0, 2.0, 1.0])}, 1024)
    values = [draws[i]["a"] for i in range(1024)]
    assert [values.count(each) for each in ("x", "y", {"kind": "Gust"})] == pytest.approx([256, 512, 256], abs=2)
    assert Draws({"a": Choice([1, 2])}, 2).extremes("a") == (1, 2)


def test_whole_numbers_are_whole():
    assert all(type(Draws({"a": Integers(0, 9)}, 50)[i]["a"]) is int for i in range(50))


def test_draws_are_the_same_whenever_they_are_asked_for():
    vary = {"a": Normal(0.0, 1.0), "g": Grid([1, 2, 3]), "b": Uniform(0.0, 1.0)}
    first, second = Draws(vary, 64, seed=3), Draws(vary, 64, seed=3)
    assert [first[i] for i in range(64)] == [second[i] for i in reversed(range(64))][::-1]
    assert list(first[0]) == ["a", "g", "b"]
    assert first[0] != Draws(vary, 64, seed=4)[0]
    with pytest.raises(IndexError):
        first[64]


def test_more_draws_by_sobol_go_on_with_the_same():
    vary = {"a": Normal(0.0, 1.0), "b": Uniform(0.0, 1.0)}
    few, more = Draws(vary, 100), Draws(vary, 1000)
    assert [few[i] for i in range(100)] == [more[i] for i in range(100)]


def test_each_point_of_the_grids_is_taken_in_turn():
    draws = Draws({"a": Grid(range(3)), "b": Grid(["x", "y"])}, 12)
    assert draws.points == 6
    assert [tuple(draws[i].values()) for i in range(6)] == [(a, b) for a in range(3) for b in "xy"]
    assert [draws[i] for i in range(6)] == [draws[i + 6] for i in range(6)]


def test_grids_from_to():
    assert list(Grid.of({"from": 0, "to": 49}).values) == list(range(50))
    assert Grid.of({"from": 0.1, "to": 0.5, "step": 0.1}).values == pytest.approx([0.1, 0.2, 0.3, 0.4, 0.5])
    assert Grid.of({"from": 1, "to": 8, "step": 3}).ends == (1, 7)
    assert Grid(["b", "a"]).ends == ("b", "a")


@pytest.mark.parametrize("distribution", [*ORACLES, Choice(["x"], [1.0]), Grid([1, 2]), Grid(range(2, 9, 3))], ids=repr)
def test_plain_data_makes_them_again(distribution):
    plain = distribution.plain
    if isinstance(distribution, Grid):
        again = Grid.of(plain) if isinstance(plain, dict) else Grid(plain)
    else:
        again = distribution_of(plain)
    assert again == distribution


def test_extremes_are_ends_or_what_is_drawn():
    draws = Draws({"a": Normal(0.0, 1.0), "b": Normal(0.0, 1.0, low=-1.0), "c": Uniform(2.0, 3.0)}, 256)
    values = [draws[i]["a"] for i in range(256)]
    assert draws.extremes("a") == (min(values), max(values))
    assert draws.extremes("b")[0] == -1.0
    assert draws.extremes("c") == (2.0, 3.0)


def test_names_are_those_of_the_kinds():
    assert all(kind.name == name for name, kind in DISTRIBUTIONS.items())


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({"distribution": "unifrom"}, "got 'unifrom', .*Did you mean 'uniform'"),
        ({"distribution": "uniform", "low": 1.0}, "high: got nothing"),
        ({"distribution": "uniform", "low": 1.0, "high": 0.0}, "high: got 0.0, expected a number above low = 1"),
        ({"distribution": "uniform", "low": -1e308, "high": 1e308}, "ends whose distance is a number"),
        ({"distribution": "uniform", "low": 1.0, "high": inf}, "high: got inf"),
        ({"distribution": "log-uniform", "low": 0.0, "high": 1.0}, "low: got 0.0, expected a positive"),
        ({"distribution": "normal", "mean": 0.0, "std": 0.0}, "std: got 0.0"),
        ({"distribution": "normal", "mean": float("nan"), "std": 1.0}, "mean: got nan"),
        ({"distribution": "normal", "mean": 0.0, "std": 1.0, "low": "x"}, "low: got 'x'"),
        ({"distribution": "normal", "mean": 0.0, "std": 1.0, "hihg": 1.0}, "hihg: got 'hihg', .*Did you mean 'high'"),
        ({"distribution": "log-normal", "median": -1.0, "sigma": 1.0}, "median: got -1.0"),
        ({"distribution": "triangular", "low": 0.0, "mode": 2.0, "high": 1.0}, "mode: got 2.0"),
        ({"distribution": "integers", "low": 0.5, "high": 3}, "low: got 0.5"),
        ({"distribution": "integers", "low": 4, "high": 3}, "high: got 3"),
        ({"distribution": "choice", "among": []}, "among: got"),
        ({"distribution": "choice", "among": [1, 2], "weights": [1.0]}, "weights: got"),
        ({"distribution": "choice", "among": [1, 2], "weights": [0.0, 0.0]}, "not all 0"),
    ],
)
def test_what_is_no_distribution_is_refused(table, said):
    with pytest.raises(rumo.ArgumentError, match=said):
        distribution_of(table)


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({"from": 0}, "to: got nothing"),
        ({"from": 3, "to": 1}, "to: got 1"),
        ({"from": 0, "to": 1, "step": 0}, "step: got 0"),
        ({"from": 0, "to": 1, "stp": 1}, "stp: got 'stp'"),
        ({"from": "a", "to": 1}, "from: got 'a'"),
        ({"from": 0, "to": 1e9, "step": 0.001}, "step: got 0.001, expected at most"),
    ],
)
def test_what_is_no_grid_is_refused(table, said):
    with pytest.raises(rumo.ArgumentError, match=said):
        Grid.of(table)


@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_each_point_of_a_grid_sees_all_of_a_distribution(sampling):
    draws = Draws({"delay": Grid([1, 2, 3, 4]), "speed": Uniform(0.0, 1.0), "mass": Uniform(0.0, 1.0)}, 256, sampling)
    for delay in (1, 2, 3, 4):
        seen = [draws[i] for i in range(256) if draws[i]["delay"] == delay]
        for name in ("speed", "mass"):
            values = [each[name] for each in seen]
            assert len(values) == 64
            assert min(values) < 0.1
            assert max(values) > 0.9
            assert np.mean(values) == pytest.approx(0.5, abs=0.1)
