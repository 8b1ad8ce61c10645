"""What lies ahead: parameters along the horizon, and paths that follow the vehicle."""

from dataclasses import dataclass

import numpy as np
import pytest
from problems import pendulum

import rumo
from rumo.references import Following, Held, Preview, Sampled, Sine, SinePath, as_reference
from rumo.signals import NamedArray, Signals
from rumo.simulation import ClosedLoop, Scenario
from rumo.studies.paper import CLOSE_WEIGHTS, PaperStudy
from rumo.vehicles import PAPER_CAR

TIMES = 0.05 * np.arange(13)


@dataclass(frozen=True)
class Hill:
    """Gravity changes where the pendulum is about to be: at 0.5 s, then for good."""

    def gravity(self, times):
        return np.where(times < 0.5 - 1e-9, 9.81, 3.0)

    def preview(self, times, x):
        return Preview({"angle": 0.3}, {"gravity": self.gravity(times[:-1])})

    def sample(self, times, rng):
        return self.gravity(times)


def run(reference, **changes):
    problem = pendulum()
    return Scenario(problem, problem.model, [0.3, 0.0], reference, 2.0, disturbances={"gravity": Hill()}, **changes)


def test_parameters_ahead_reach_the_controller():
    log = run(Hill(), discretization="radau3").run()
    for k, row in enumerate(log["parameters"].data[..., 0]):
        np.testing.assert_array_equal(row, Hill().gravity(0.05 * (k + np.arange(12))))
    # What is known ahead is prepared for: the first plan is right about what follows, but for the discretisation.
    planned, driven = log["predicted_states"].data[5, :12, 0], log["plant"].data[5:17, 0]
    surprised = run({"angle": 0.3}, discretization="radau3").run()
    naive = surprised["predicted_states"].data[5, :12, 0] - surprised["plant"].data[5:17, 0]
    assert np.abs(planned - driven).max() < 0.5 * np.abs(naive).max()


def test_parameters_of_a_run_stay_in_it():
    controller = rumo.RealTimeIteration(pendulum(parameters={"gravity": 8.0}))
    run(Hill()).run(controller)
    np.testing.assert_array_equal(controller.parameters, 8.0)
    log = run({"angle": 0.3}).run(controller)
    np.testing.assert_array_equal(log["parameters"], 8.0)
    for sample in ClosedLoop(run(Hill()), controller):
        if sample.index == 3:
            break
    np.testing.assert_array_equal(controller.parameters, 8.0)


@dataclass(frozen=True)
class Glimpse:
    """A hill that is seen for some samples only."""

    seen: range

    def preview(self, times, x):
        return Preview({"angle": 0.3}, {"gravity": 3.0} if round(times[0] / 0.05) in self.seen else {})


def test_what_is_not_previewed_is_the_controllers_own():
    controller = rumo.RealTimeIteration(pendulum(parameters={"gravity": 8.0}))
    controller.parameters = {"gravity": 7.0}
    log = run(Glimpse(range(3, 6))).run(controller)
    gravity = log["parameters"].data[:, :, 0]
    assert (gravity[3:6] == 3.0).all()
    assert (gravity[:3] == 7.0).all()
    assert (gravity[6:] == 7.0).all()
    # What is set between two samples is the controller's own as well, then and after the run.
    loop, believed = ClosedLoop(run(Glimpse(range(3, 6))), controller), []
    for sample in loop:
        believed.append(sample.parameters[0, 0])
        if sample.index in (1, 4):
            loop.controller.parameters = {"gravity": 5.0 + sample.index}
    assert believed[:8] == [7.0, 7.0, 6.0, 3.0, 3.0, 3.0, 9.0, 9.0]
    np.testing.assert_array_equal(controller.parameters, 9.0)


def test_the_state_is_that_of_the_controller_and_finite():
    seen = []

    class Watching:
        def preview(self, times, x):
            seen.append((times[0], x["angle"], x["rate"]))
            return Preview({"angle": 0.0})

    log = run(Watching(), faults=(rumo.faults.Missing(range(4, 7)),)).run()
    expected = np.column_stack([log["time"], log["plant"]])
    expected[4:7, 1:] = expected[3, 1:]
    np.testing.assert_array_equal(seen, expected)


def test_unknown_parameters_are_named():
    class Wrong:
        def preview(self, times, x):
            return Preview({"angle": 0.0}, {"gravitiy": 9.81})

    with pytest.raises(rumo.UnknownNameError, match=r"parameters: got 'gravitiy'.*Did you mean 'gravity'\?"):
        run(Wrong()).run()


def test_what_is_previewed_is_a_preview():
    class Wrong:
        def preview(self, times, x):
            return {"angle": 0.0}

    with pytest.raises(rumo.ArgumentError, match=r"reference.preview\(\): got {'angle': 0.0}, expected a rumo.ref"):
        run(Wrong()).run()


def test_kinds_of_references():
    x = NamedArray(Signals({"angle": "rad"}, "states"), np.zeros(1))
    sine = Sine("angle", 1.0, 0.5, 0.4)
    lines = Sampled((0.1, 0.3), {"angle": (1.0, 2.0)})
    steps = Sampled((0.1, 0.3), {"angle": (1.0, 2.0)}, steps=True)
    expected = [
        (sine, 1.0 + 0.5 * np.sin(2.0 * np.pi * TIMES / 0.4)),
        (lines, np.clip(1.0 + (TIMES - 0.1) / 0.2, 1.0, 2.0)),
        (steps, np.where(TIMES < 0.3 - 1e-9, 1.0, 2.0)),
        (Held({"angle": 3}), np.full(13, 3.0)),
        ({"angle": 3}, np.full(13, 3.0)),
        (lambda t: {"angle": t**2}, TIMES**2),
    ]
    for reference, values in expected:
        preview = as_reference(reference).preview(TIMES, x)
        np.testing.assert_allclose(preview.signals["angle"], values, atol=1e-12)
        assert not preview.parameters


def test_previews_have_arrays_of_their_own():
    ahead = np.zeros(13)
    preview = Preview({"angle": ahead}, {"gravity": ahead})
    for values in (preview.signals["angle"], preview.parameters["gravity"]):
        assert not np.shares_memory(values, ahead)
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 1.0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Sine("angle", 0.0, 1.0, 0.0), "period: got 0.0, expected a positive finite number"),
        (lambda: Sampled((0.0, 0.0), {}), r"times: got \[0.0, 0.0\], expected at least one time, ascending"),
        (lambda: Sampled((0.0, 1.0), {"a": (1.0,)}), r"values\['a'\]: got shape \(1,\), expected shape \(2,\)"),
        (lambda: Following(SinePath(), window=0.0), "window: got 0.0, expected a positive"),
        (lambda: as_reference(Held), "reference: got <class"),
        (lambda: Held({"angle": np.nan}), r"reference\['angle'\]: got nan, expected a finite number"),
        (lambda: Held({"angle": None}), r"reference\['angle'\]: got None, expected numbers"),
        (lambda: Preview({"angle": None}), r"reference\['angle'\]: got None, expected numbers"),
        (lambda: Sampled((0.0, 1.0), {"a": (1.0, np.nan)}), r"values\['a'\]: got NaN or infinity, expected finite"),
        (lambda: Sampled((0.0, np.inf), {}), "times: got"),
        (lambda: Following(lambda t, x: {}), r"path: got a function of \(t, x\), expected a function of times alone"),
    ],
)
def test_mistakes(make, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        make()


def test_following_finds_the_nearest_point():
    path = SinePath()
    follow = Following(path)
    states = Signals({"p_x": "m", "p_y": "m"}, "states")
    for clock, there in ((3.0, 3.0), (3.0, 1.0), (5.0, 7.9)):
        point = path(np.array([there]))
        slope = path.amplitude * 2.0 * np.pi / path.wavelength * np.cos(2.0 * np.pi * point["p_x"] / path.wavelength)
        # Half a metre aside, at a right angle to the path.
        aside = 0.5 * np.array([-slope[0], 1.0]) / np.hypot(1.0, slope[0])
        place = NamedArray(states, np.array([point["p_x"][0], point["p_y"][0]]) + aside)
        ahead = follow.preview(clock + TIMES, place).signals
        for name, values in path(there + TIMES).items():
            np.testing.assert_allclose(ahead[name], values, atol=1e-5)
    lost = follow.preview(3.0 + TIMES, NamedArray(states, np.full(2, np.nan))).signals
    np.testing.assert_allclose(lost["p_x"], path(3.0 + TIMES)["p_x"])


def test_a_car_that_starts_late_is_not_hurried():
    """Two seconds late, the clock's path asks for a dash to catch up; the path that follows the car does not."""
    path = SinePath(vehicle=PAPER_CAR)
    study = PaperStudy(weights=CLOSE_WEIGHTS, initial_error=0.0)

    @dataclass(frozen=True)
    class Later:
        path: object

        def preview(self, times, x):
            return as_reference(self.path).preview(times + 2.0, x)

    top = {}
    controller = rumo.RealTimeIteration(study.problem())
    for kind, reference in (("clock", path), ("progress", Following(path))):
        log = rumo.simulate(controller, study.plant(), study.initial_state(), Later(reference), 4.0)
        top[kind] = float(log["plant"].sel(plant_state="v_x").max())
        assert set(log["status"].data) <= {"OPTIMAL", "SOFT_VIOLATED"}
    assert top["progress"] < 8.2 < 9.0 < top["clock"]
