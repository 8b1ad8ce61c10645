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


@pytest.mark.parametrize(("steps", "length"), [(3_000, 50), pytest.param(100_000, STEPS, marks=pytest.mark.slow)])
def test_judged(steps, length):
    total, bad = soak(steps, seed=0, length=length)
    assert not bad
    assert total["proven"] > 2 * total["undecided"]


def test_couplings_that_vanish_and_come_back(tmp_path):
    """Equations of states that were decoupled at first, by which pivots must not be chosen later on."""
    watch = Watch(tmp_path)
    assert not [line for seed in (5478, 10739) for line in judged(watch, seed)[1]]


def test_solutions_that_rounding_blurs(tmp_path):
    """States that hardly move beside others, responses of 1e12 to an input's last digit, and references of 1e20."""
    watch = Watch(tmp_path)
    assert not [line for seed in (170, 4280, 3370) for line in judged(watch, seed)[1]]
