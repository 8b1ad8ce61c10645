"""Figures of merit of the paper's drive do not depend on how its plant is integrated."""

import pytest

from rumo.simulation import Plant
from rumo.studies import PaperStudy
from rumo.studies.kpis import KPIS, STEPS, Driven, kpis

LASTING = [name for name in KPIS if name not in STEPS]
"""Figures that do not differ from run to run."""


def merits(study, **settings):
    """Numbers by name, those of mappings by both names."""
    plant = Plant(study.plant().model, study.sampling_time, **settings)
    log = study.scenario("rti", study.problem(), plant).run()
    found = kpis(Driven(log), LASTING)
    parts = {name: value if isinstance(value, dict) else {"": value} for name, value in found.items()}
    return {(name, key): value for name, values in parts.items() for key, value in values.items()}


def far_off(study, **settings):
    """Largest difference of a figure to that with CVODES at 1e-12, over 1e-3 plus its size."""
    exact, found = merits(study, tolerance=1e-12, method="sundials"), merits(study, **settings)
    numbers = [name for name, value in exact.items() if isinstance(value, int | float)]
    assert len(numbers) > 10
    return max(abs(found[name] - exact[name]) / (1e-3 + abs(exact[name])) for name in numbers)


def test_short_drive():
    assert far_off(PaperStudy(duration=4.0)) < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_whole_drives(seed):
    off = far_off(PaperStudy(seed=seed))
    print(f"seed {seed}: {off:.1e}")
    assert off < 1e-8
