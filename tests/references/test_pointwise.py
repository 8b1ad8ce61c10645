"""References that a loop asks for many samples at once: the same as sample by sample, to the last bit."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from problems import pendulum

import rumo
from rumo.references import Held, OfTime, Path, Sampled, Sine, SinePath, SpeedProfile, TimedPath, as_reference
from rumo.references.base import is_pointwise
from rumo.references.manoeuvres import SineWithDwell, StepSteer
from rumo.references.road import Road
from rumo.references.timed_path import Legs
from rumo.simulation.previews import BLOCK, Previews
from rumo.vehicles import PAPER_CAR

ROAD = Road((0.0, 20.0, 60.0), (0.0, 0.05, 0.0), (5.0, 9.0, 7.0), vehicle=PAPER_CAR)
BEND = TimedPath(
    Path.from_curvature([0.0, 30.0, 60.0], [0.0, 0.04, 0.0]), SpeedProfile(np.array([0.0, 60.0]), np.full(2, 8.0))
)
REFERENCES = {
    "held": Held({"angle": 0.3}),
    "sine": Sine("angle", 0.1, 0.4, 1.3),
    "lines": Sampled((0.0, 0.7, 2.0), {"angle": (0.0, 1.0, -1.0)}),
    "steps": Sampled((0.0, 0.7, 2.0), {"angle": (0.0, 1.0, -1.0)}, steps=True),
    "sine path": SinePath(vehicle=PAPER_CAR),
    "steep sine path": SinePath(amplitude=200.0, wavelength=20.0),
    "road": ROAD,
    "timed path": BEND,
    "legs": Legs((BEND, BEND)),
    "step steer": StepSteer(0.3),
    "sine with dwell": SineWithDwell(0.3),
}


@pytest.mark.parametrize("reference", REFERENCES.values(), ids=REFERENCES.keys())
def test_values_depend_on_their_own_time_alone(reference):
    times = np.random.default_rng(0).permutation(np.r_[np.linspace(0.0, 9.0, 300), 1e-9, 0.7, 2.0])
    together = reference(times)
    assert is_pointwise(reference)
    for i in range(0, len(times), 7):
        for name, values in reference(times[i : i + 1]).items():
            assert values[0] == together[name][i], (name, times[i])
    for name, values in reference(times[50:66]).items():
        np.testing.assert_array_equal(values, together[name][50:66], err_msg=name)


@pytest.mark.parametrize("lead", [0.0, 0.013])
def test_previews_are_those_of_each_sample(lead):
    reference, problem = Sine("angle", 0.1, 0.4, 1.3), pendulum()
    times = problem.sampling_time * np.arange(BLOCK + 5)
    previews = Previews(reference, problem, times)
    for k in (0, 1, BLOCK - 1, BLOCK, BLOCK + 4, 3):
        ahead = previews.at(k, lead, None).signals["angle"]
        np.testing.assert_array_equal(ahead, reference(times[k] + lead + problem.times)["angle"])
        with pytest.raises(ValueError, match="read-only"):
            ahead[0] = 0.0


class Begins(Sine):
    """Knows when it was asked first."""

    def __call__(self, t):
        return {self.signal: np.asarray(t) - t[0]}


class Ahead(Sine):
    """Previews in a way of its own."""

    def preview(self, times, x):
        return super().preview(times + 1.0, x)


@dataclass(frozen=True)
class Own(OfTime):
    """Says that it is pointwise."""

    pointwise: ClassVar[bool] = True

    def __call__(self, t):
        return {"angle": 0.1 * np.asarray(t)}


def test_who_does_not_say_so_is_asked_at_each_sample():
    sine = Sine("angle", 0.0, 1.0, 2.0)
    assert is_pointwise(sine)
    assert is_pointwise(Own())
    for other in (Begins("angle", 0.0, 1.0, 2.0), Ahead("angle", 0.0, 1.0, 2.0), as_reference(lambda t: {"angle": t})):
        assert not is_pointwise(other)


def test_functions_with_a_memory_are_called_once_a_sample():
    asked, problem = [], pendulum()

    def wanted(t):
        asked.append(t[0])
        return {"angle": np.full(len(t), 0.01 * len(asked))}

    log = rumo.Scenario(problem, problem.model, [0.0, 0.0], wanted, 1.0).run()
    np.testing.assert_array_equal(asked, log["time"])
    np.testing.assert_array_equal(log["reference"][:, 0], 0.01 * np.arange(1, 21))
