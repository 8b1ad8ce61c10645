"""Runs as plain data: sent, hashed, and written to files as they are."""

import pickle
import tomllib

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import rumo
from rumo.scenarios import Recipe, settings_of
from rumo.scenarios.files import flattened, line_of, written

GUST = {"kind": "Gust", "mean": 0.0, "peak": 5.0, "start": 1.0, "duration": 2.0}
OWN = """
from typing import Annotated

from rumo.scenarios import Argument, Recipe
from beside import SPEED

def make(*, speed: Annotated[float, Argument("m/s", "How fast.", above=0.0)] = SPEED, words: str = "none"):
    return Recipe("paper", {"speed": speed}).run()

def needs(*, speed):
    return make(speed=speed)

def nothing():
    return 3

there = make(speed=5.0)
"""


@pytest.fixture
def own(tmp_path):
    (tmp_path / "my_file.py").write_text(OWN)
    (tmp_path / "beside.py").write_text("SPEED = 7.0")
    return tmp_path / "my_file.py"


def test_arguments_and_settings_are_told_apart():
    run = Recipe("paper", {"problem.weights.p_y": 2.0, "speed": 9, "seed": 4, "estimator.cutoff": 3.0}).run()
    found = settings_of(run)
    assert (found["x.v_x"], found["reference.speed"]) == (9.0, 9.0)
    assert (found["problem.weights.p_y"], found["seed"], found["estimator.cutoff"]) == (2.0, 4, 3.0)


def test_a_table_is_no_argument():
    run = Recipe("paper", {"estimator": {"kind": "Butterworth", "cutoff": 2.0}}).run()
    assert run.estimator == rumo.Butterworth(2.0)


def test_it_is_written_and_read_back(tmp_path):
    recipe = Recipe(
        "paper",
        {
            "speed": 9,
            "mass": 1.1e-3,
            "problem.weights.p_y": [1.0] * 15,
            "disturbances.wind_speed": GUST,
            "faults": [{"kind": "Missing", "when": {"from": 3, "to": 5}, "signals": ["p_x"]}],
            "estimator": "none",
            "settings.trusted_step": float("inf"),
        },
    )
    recipe.to_toml(tmp_path / "best.toml")
    assert Recipe.from_toml(tmp_path / "best.toml") == recipe
    assert Recipe.of(recipe.plain) == recipe
    assert pickle.loads(pickle.dumps(recipe)) == recipe


texts = st.text(st.characters(exclude_categories=["Cs"]), max_size=10)
plain = st.recursive(
    st.booleans() | st.integers(-(2**62), 2**62) | st.floats(allow_nan=False) | texts,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(texts, inner, max_size=3),
    max_leaves=8,
)


# Hypothesis makes its table of all characters at the first text, once on a machine: that draw is slow.
@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.dictionaries(texts, plain, max_size=4))
def test_what_is_written_is_toml(table):
    assert tomllib.loads(written({"scenario": table})) == {"scenario": table}


def test_nested_tables_are_dotted_names():
    table = {"problem": {"weights": {"p_y": 2.0}}, "disturbances": {"wind_speed": GUST}, "seed": 1}
    assert flattened(table) == {"problem.weights.p_y": 2.0, "disturbances.wind_speed": GUST, "seed": 1}


def test_nested_tables_are_the_same_from_python():
    nested = Recipe("paper", {"problem": {"weights": {"p_y": 2.0}}, "faults": []})
    assert nested == Recipe("paper", {"problem.weights.p_y": 2.0, "faults": []}) == Recipe.of(nested.plain)
    assert nested.with_settings({"problem": {"weights": {"p_y": 3.0}}}).settings["problem.weights.p_y"] == 3.0


def test_a_setting_has_one_value(tmp_path):
    (tmp_path / "run.toml").write_text('[scenario]\nbase = "paper"\n"x.psi" = 0.1\n[scenario.x]\npsi = 0.2\n')
    with pytest.raises(rumo.ArgumentError, match=r"x\.psi: got two values, expected one"):
        Recipe.from_toml(tmp_path / "run.toml")
    with pytest.raises(rumo.ArgumentError, match=r"sensors\.noise: got an empty table, .* Or leave it out"):
        Recipe.of({"base": "paper", "sensors": {"noise": {}}})


def test_lines_are_found(tmp_path):
    (tmp_path / "file.toml").write_text(
        '[scenario]\nbase = "paper"\n"problem.weights.p_y" = 2.0\n[scenario.disturbances.wind_speed]\nkind = "Gust"\n'
    )
    file = tmp_path / "file.toml"
    assert line_of(file, "scenario.base") == 2
    assert line_of(file, "scenario.problem.weights.p_y") == 3
    assert line_of(file, "scenario.disturbances.wind_speed") == 4
    assert line_of(file, "scenario.disturbances.wind_speed.kind") == 5
    assert line_of(file, "scenario.nothing") is None
    assert line_of(tmp_path / "none.toml", "scenario") is None


def test_ones_own_function(own):
    recipe = Recipe(f"{own}:make", {"speed": 6.0, "seed": 2})
    assert settings_of(recipe.run()).items() >= {"x.v_x": 6.0, "seed": 2}.items()
    assert settings_of(Recipe(f"{own}:make").run())["x.v_x"] == 7.0
    assert recipe.arguments["speed"].unit == "m/s"
    assert settings_of(Recipe(f"{own}:there", {"duration": 3.0}).run()).items() >= {"duration": 3.0}.items()


def test_the_name_of_ones_own_file_is_relative_to_the_recipes(own):
    (own.parent / "run.toml").write_text('[scenario]\nbase = "my_file.py:make"\nspeed = 4.0\n')
    assert settings_of(Recipe.from_toml(own.parent / "run.toml").run())["x.v_x"] == 4.0


def test_identity_is_of_what_a_file_holds(own):
    recipe = Recipe(f"{own}:make")
    before = recipe.identity
    assert str(own.parent) not in str(before)
    own.write_text(OWN.replace("5.0", "4.0"))
    assert recipe.identity != before
    assert settings_of(Recipe(f"{own}:there").run())["x.v_x"] == 4.0


def test_ones_own_files_are_refused_in_words(own):
    for base, given_, said in (
        (f"{own}:mak", {}, r"got 'mak', .*Did you mean 'make'"),
        (f"{own}:needs", {}, "speed: got nothing, expected a value"),
        (f"{own}:nothing", {}, "which gives 3, expected a rumo.Scenario"),
        (f"{own}:make", {"speed": -1.0}, "speed: got -1.0, expected a number above 0"),
        (f"{own}:make", {"words": 3}, "words: got 3, expected a text"),
        (f"{own.parent / 'no.py'}:make", {}, "No such file"),
    ):
        with pytest.raises(rumo.ArgumentError, match=said):
            Recipe(base, given_).run()
    own.write_text("1 / 0")
    with pytest.raises(rumo.ArgumentError, match="which raises ZeroDivisionError"):
        Recipe(f"{own}:make").run()


def test_what_is_no_recipe_is_refused(tmp_path):
    for arguments, said in (
        (("papers",), "base: got 'papers', .*Did you mean 'paper'"),
        ((3,), "base: got 3"),
        (("paper", {"speed": {1, 2}}), "speed: got {1, 2}, expected a number"),
        (("paper", [1]), "settings: got"),
    ):
        with pytest.raises(rumo.ArgumentError, match=said):
            Recipe(*arguments)
    with pytest.raises(rumo.ArgumentError, match=r"speeed: got 'speeed', .*Did you mean 'speed'"):
        Recipe("paper", {"speeed": 1.0}).run()
    (tmp_path / "bad.toml").write_text("[scenario\nspeed = 1")
    with pytest.raises(rumo.FileError, match="line 1"):
        Recipe.from_toml(tmp_path / "bad.toml")
    (tmp_path / "bad.toml").write_text("[scenari]")
    with pytest.raises(rumo.ArgumentError, match=r"scenario\.base: got nothing"):
        Recipe.from_toml(tmp_path / "bad.toml")
    with pytest.raises(rumo.ArgumentError, match="No such file"):
        Recipe.from_toml(tmp_path / "none.toml")
