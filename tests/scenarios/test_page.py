"""The page on scenario files names what there is."""

import re
from pathlib import Path

import pytest

from rumo.scenarios import BASES, KINDS, arguments_of
from rumo.scenarios.kinds import DISTURBANCES, ESTIMATORS, REFERENCES

PAGE = (Path(__file__).parents[2] / "docs" / "scenario-files.md").read_text(encoding="utf-8")


def shown(value):
    return "none" if value is None else f"{value:g}" if isinstance(value, float) else str(value)


@pytest.mark.parametrize("base", BASES)
def test_arguments_of_bases_stand_there_as_they_are(base):
    section = PAGE.split(f"### {base}\n")[1].split("\n###")[0]
    rows = re.findall(r"^\| (`.*) \|$", section, re.MULTILINE)
    assert rows == [
        f"`{name}` | {argument.unit} | {shown(argument.default)} | {argument.meaning}"
        for name, argument in arguments_of(BASES[base]).items()
    ]


def test_kinds_stand_there():
    for kind in (*DISTURBANCES, *ESTIMATORS, *REFERENCES):
        assert f"`{kind.__name__}`" in PAGE
        assert KINDS[kind.__name__] is kind
