"""A problem as C text says the same as its description."""

import re

import numpy as np
import pytest
from problems import PROBLEMS

from rumo.controllers.engines.described import core_problem
from rumo.kernel import problem_source
from rumo.transcription import Transcription

WORDS = {"NULL": None, "NAN": np.nan, "INFINITY": np.inf, "-INFINITY": -np.inf}


def arrays_of(text):
    """Name to values of the arrays in a header."""
    found = re.findall(r"static const (int|double) (\w+)\[\] = \{\n(.*?)\};\n", text, flags=re.DOTALL)
    return {
        name: np.array(
            [WORDS[word] if word in WORDS else float(word) for word in body.replace("\n", " ").split(", ") if word]
        )
        if kind == "double"
        else np.array([int(word) for word in body.split(",")])
        for kind, name, body in found
    }


def described(name):
    problem = PROBLEMS[name]()[0]
    return core_problem(Transcription(problem))


@pytest.mark.parametrize("name", PROBLEMS)
def test_every_number_is_there(name):
    description = described(name)
    arrays = arrays_of(problem_source(description, "plant"))
    expected = {f"plant_{key}": value for key, value in description.values.items() if np.size(value) and np.ndim(value)}
    assert arrays.keys() == expected.keys()
    for key, value in expected.items():
        np.testing.assert_array_equal(arrays[key], value.ravel(), key)


def test_text():
    text = problem_source(described("car"), "car")
    assert text.startswith("/*")
    assert "static const rumo_problem car = {\n    .sizes = {\n        .horizon = 15,\n        .states = 9," in text
    nothing = "{\n        .count = 0,\n        .first = 68,\n        .row = NULL,\n        .column = NULL,\n    }"
    assert f"    .Cu = {nothing},\n" in text
    assert max(map(len, text.splitlines())) <= 120
    assert text == problem_source(described("car"), "car"), "the same each time"
