"""What the gate makes of sensors that fail in a drive, and of drives in which none does."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from rumo.references import SinePath
from rumo.simulation.faults import Fault, Offset, Reading
from rumo.studies import PaperStudy
from rumo.studies.faults import BASE
from rumo.studies.kpis import tracking_error
from rumo.studies.paper.study import NOISE
from rumo.vehicles import PAPER_CAR

BAD = range(75, 80)
SIGMA = np.array([NOISE.get(name, 0.01) for name in BASE.problem().model.states])


@dataclass(frozen=True)
class AllZero(Fault):
    """Every sensor says 0."""

    def sense(self, received, past, bad, signals):
        return np.zeros_like(received)


@dataclass(frozen=True)
class Swapped(Fault):
    """Two axes are mixed up."""

    def sense(self, received, past, bad, signals):
        swapped = received.copy()
        swapped[[0, 1]] = received[[1, 0]]
        return swapped


@dataclass(frozen=True)
class Noisy(Fault):
    """Thirty times the noise."""

    seed: int = 0

    def sense(self, received, past, bad, signals):
        rng = np.random.default_rng([self.seed, bad])
        return received + 29.0 * SIGMA * rng.standard_normal(len(received))


FAULTS = {
    "a turn": Offset(BAD, "psi", 2.0 * np.pi),
    "zero": AllZero(BAD),
    "swapped": Swapped(BAD),
    "noise": Noisy(BAD),
    "standing": Reading(BAD, "v_x", 0.0),
    "5 m aside": Offset(BAD, "p_y", 5.0),
    "30 m aside": Offset(BAD, "p_y", 30.0),
    "10 m ahead": Offset(BAD, "p_x", 10.0),
    "heading": Offset(BAD, "psi", 1.0),
    "no heading": Reading(BAD, "psi", np.nan),
}


def held_back(log):
    """Whether readings were not used (K, nx): the plan does not start from them, give or take full turns."""
    apart = log.predicted_states.values[:, 0] - log.estimated.values
    apart[:, 2] -= 2.0 * np.pi * np.round(apart[:, 2] / (2.0 * np.pi))
    return ~(np.abs(apart) < 1e-9)


def drive(study, fault=None, controller="rti", **changes):
    scenario = replace(study.scenario(controller, study.problem(), study.plant()), **changes)
    return replace(scenario, faults=() if fault is None else (fault,)).run()


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 3, 4))])
@pytest.mark.parametrize("name", FAULTS)
def test_five_samples_of_what_cannot_be_do_not_lose_the_car(name, seed):
    fault = FAULTS[name]
    log = drive(replace(BASE, duration=6.0, seed=seed), replace(fault, seed=seed) if name == "noise" else fault)
    assert tracking_error(log)[75:].max() < (0.5 if name == "noise" else 0.2)
    held = held_back(log)
    assert not held[: BAD.start].any()
    if name != "noise":  # some of which is believed, so that what comes next differs
        assert not held[BAD.stop :].any()


@pytest.mark.parametrize("controller", ["ltv", pytest.param("nlp", marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ["zero", "swapped", "standing"])
def test_nor_with_another_controller(name, controller):
    log = drive(replace(BASE, duration=5.0), FAULTS[name], controller)
    assert tracking_error(log)[75:].max() < 0.5


@pytest.mark.parametrize("name", ["swapped", "standing", "heading", "no heading"])
def test_the_other_readings_are_used(name):
    log = drive(replace(BASE, duration=4.0), FAULTS[name])
    held = held_back(log)[BAD.start : BAD.stop]
    columns = {"swapped": [0, 1], "standing": [3], "heading": [2], "no heading": [2]}[name]
    assert held[:, columns].all()
    assert not np.delete(held, columns, axis=1).any()
    assert set(log.status.values) <= {"OPTIMAL", "SOFT_VIOLATED"}


@pytest.mark.parametrize("name", ["p_x", "p_y", "v_y"])
def test_what_goes_on_is_believed(name):
    """Also where readings move on from sample to sample."""
    log = drive(replace(BASE, duration=4.0), Offset(range(75, 100), name, 10.0))
    held = held_back(log)
    column = BASE.problem().model.states.index(name)
    assert held[75:83, column].all()
    assert not held[83, column]


FAST = SinePath(3.0, 60.0, 12.0, PAPER_CAR)
HEALTHY = {
    "raw": BASE,
    "filtered": PaperStudy(),
    "10 m aside": PaperStudy(initial_error=10.0),
    "12 m/s": replace(BASE, path=FAST),
    "without noise": replace(BASE, noise={}, path=FAST),
    "delay 3": replace(BASE, delay=3),
}


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow), pytest.param(2, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", HEALTHY)
def test_nothing_is_held_back_of_what_is_right(name, seed):
    log = drive(replace(HEALTHY[name], duration=10.0, seed=seed))
    assert not held_back(log).any()
    assert set(log.status.values) <= {"OPTIMAL", "SOFT_VIOLATED"}
