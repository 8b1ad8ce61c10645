"""Random steps: no command that is bad, and nothing called solved that is not."""

import sys

import pytest

from rumo.kernel.tailored import CompilerError, compiler
from soak.judged import STEPS, judged, soak
from soak.watched import Watch


def has_compiler():
    try:
        return bool(compiler())
    except CompilerError:
        return False


pytestmark = [
    pytest.mark.skipif(not has_compiler(), reason="no C compiler on this machine"),
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the watched core is built as on Linux"),
]


FOUND = {
    5478: "equations of states that were decoupled at first, by which pivots must not be chosen later on",
    10739: "the same",
    170: "states that hardly move beside others",
    4280: "responses of 1e12 to an input's last digit",
    3370: "references of 1e20",
    14789: "inputs of 1e283, in which steps are lost",
    42103: "derivatives of few digits, by references of 1e20",
    40163: "prices of limits that inputs hardly move any more",
}
"""Seeds of what was found once, in the core or in the judge."""


@pytest.mark.parametrize(("steps", "length"), [(1_000, 50), pytest.param(100_000, STEPS, marks=pytest.mark.slow)])
def test_judged(steps, length, tmp_path):
    watch = Watch(tmp_path)
    total, bad = soak(watch, steps, seed=0, length=length)
    assert not bad
    assert total["proven"] > 2 * total["undecided"]


@pytest.mark.slow
def test_what_was_found_once(tmp_path):
    watch = Watch(tmp_path)
    assert not [line for seed in FOUND for line in judged(watch, seed)[1]]
