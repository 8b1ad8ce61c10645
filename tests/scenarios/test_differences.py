"""What is other about plain data is named, with what it was and is."""

import pytest

from rumo.scenarios.differences import LONGEST, differences


@pytest.mark.parametrize(
    ("before", "now", "words"),
    [
        ({"a": 1}, {"a": 1}, ""),
        ({"a": {"b": 1.0, "c": 2}}, {"a": {"b": 2.0, "c": 2}}, "a.b was 1.0, is 2.0"),
        ({"a": 1}, {"b": None}, "a was 1, is not there; b was not there, is nothing"),
        ({"a": [1, 2, "x"]}, {"a": [2, "x", 3]}, "a was with 1, is with 3"),
        ({"a": [1, 2]}, {"a": [2, 1]}, "a in another order"),
        ({"a": {"sha256": "12345678ab"}}, {"a": {"sha256": "0"}}, "a has other content"),
        ({"a": "club"}, {"a": {"sha256": "12345678ab"}}, 'a was "club", is file 12345678'),
        ({"a": {"b": 1}}, {"a": 1}, 'a was {"b": 1}, is 1'),
    ],
)
def test_differences_are_named(before, now, words):
    assert differences(before, now) == words


def test_long_ones_are_cut():
    assert len(differences({"a": "x" * 1000}, {"a": "y" * 1000})) < 3 * LONGEST
    words = differences(dict.fromkeys("abcdefg", 1), dict.fromkeys("abcdefg", 2))
    assert words.endswith("; d was 1, is 2; and 3 more")
