"""Scenarios: data that can be copied, sent away and run there; loops over their samples."""

import copy
import math
import pickle
from dataclasses import replace
from multiprocessing import get_context

import numpy as np
import pytest
import xarray as xr
from problems import pendulum

import rumo
from rumo.estimation import Butterworth, Estimate, ExtendedKalman
from rumo.references import Following, Preview, Sampled, Sine, SinePath
from rumo.simulation import ClosedLoop, Gust, OrnsteinUhlenbeck, Plant, Scenario, Sensors, faults
from rumo.simulation.log import load, save
from rumo.vehicles import PAPER_CAR


def scenario(**changes):
    """A pendulum in which everything happens that can happen."""
    problem = changes.pop("problem", None) or pendulum()
    settings = {
        "plant": Plant(problem.model, problem.sampling_time),
        "x": {"angle": 0.3, "rate": 0.0},
        "reference": Sine("angle", 0.1, 0.05, 2.0),
        "duration": 0.5,
        "sensors": Sensors({"angle": 0.01, "rate": 0.02}),
        "estimator": ExtendedKalman({"angle": 0.01, "rate": 0.02}, {"angle": 0.001, "rate": 0.02}),
        "disturbances": {"gravity": OrnsteinUhlenbeck(9.81, 0.5, 0.3)},
        "faults": (faults.Missing(range(3, 5)), faults.Stuck((0.3, 0.4), "torque")),
        "seed": 3,
    }
    return Scenario(problem, **(settings | changes))


def without_times(log):
    return log.drop_vars([name for name in log.data_vars if name.endswith("_time")])


def test_simulate_is_the_scenario_run_by_a_controller_that_is_there():
    run = scenario()
    controller = rumo.RealTimeIteration(run.problem)
    log = rumo.simulate(
        controller,
        run.plant,
        run.x,
        run.reference,
        run.duration,
        sensors=run.sensors,
        estimator=run.estimator,
        disturbances=run.disturbances,
        faults=run.faults,
        seed=run.seed,
    )
    for other in (run.run(), run.run(controller)):
        xr.testing.assert_identical(without_times(log), without_times(other))


def test_samples_are_what_the_log_says():
    run = scenario()
    log, loop = run.run(), ClosedLoop(run)
    samples = list(loop)
    assert len(samples) == len(loop) == 10
    for k, sample in enumerate(samples):
        assert (sample.index, sample.time) == (k, log.time.data[k])
        for name in ("plant", "measured", "received", "estimated", "applied", "disturbance", "reference"):
            np.testing.assert_array_equal(getattr(sample, name), log[name].data[k], err_msg=name)
        np.testing.assert_array_equal(sample.commanded, log.commanded.data[k])
        np.testing.assert_array_equal(sample.states, log.true_states.data[k])
        np.testing.assert_array_equal(sample.parameters, log.parameters.data[k])
        assert sample.plan.status.name == log.status.data[k]
        np.testing.assert_array_equal(np.sqrt(np.diag(sample.covariance)), log.estimated_deviation.data[k])
    # Each loop is a new run.
    assert [sample.applied["torque"] for sample in loop] == [sample.applied["torque"] for sample in samples]


def test_the_controller_can_be_changed_between_samples():
    run = scenario(faults=(), reference={"angle": 0.1}, duration=3.0)
    loop = ClosedLoop(replace(run, sensors=Sensors(), estimator=None, disturbances={}))
    for sample in loop:
        if sample.index == 20:
            loop.controller.parameters = {"gravity": 2.0}
        assert (sample.parameters == (9.81 if sample.index <= 20 else 2.0)).all()


def run_elsewhere(run):
    return run.run()


def test_scenarios_run_in_other_processes():
    run = scenario()
    with get_context("spawn").Pool(1) as pool:
        xr.testing.assert_identical(without_times(pool.apply(run_elsewhere, (run,))), without_times(run.run()))


@pytest.mark.parametrize(
    "part",
    [
        Sensors({"angle": 0.1}, ("angle",), {"angle": 2}),
        Butterworth(2.0),
        ExtendedKalman({"angle": 0.1}, {"angle": 0.1, "rate": 0.1}, {"rate": 0.0}, {"rate": 1.0}),
        Sine("angle", 0.0, 1.0, 2.0),
        Sampled(np.array([0.0, 1.0]), {"angle": np.array([0.0, 1.0])}),
        SinePath(vehicle=PAPER_CAR),
        Following(SinePath()),
        Gust(1.0, 2.0, 3.0, 4.0),
        faults.Frozen((1.0, 2.0), ("angle",)),
        faults.Saturated(range(3), "torque", -1.0, 1.0, told=True),
        faults.Misinformed(range(3), {"torque": 100.0}),
    ],
)
def test_parts_come_back_as_they_were(part):
    assert pickle.loads(pickle.dumps(part)) == copy.deepcopy(part) == part


def test_data_with_arrays_compare():
    run = scenario(x=np.array([0.3, 0.0]))
    assert run != replace(run)
    assert len({run, run}) == 1
    estimate, preview = Estimate(np.zeros(2)), Preview({"angle": np.zeros(2)}, {"gravity": np.ones(1)})
    again = pickle.loads(pickle.dumps(preview))
    assert estimate != Estimate(np.zeros(2))
    assert again != preview
    np.testing.assert_equal(vars(again), vars(preview))


def test_failures_come_back_with_their_log(tmp_path):
    escape = rumo.Model(
        {"angle": "rad", "rate": "rad/s"},
        {"torque": "N m"},
        lambda x, u, p: {"angle": x.rate, "rate": x.rate**2 + u.torque},
        name="escape",
    )
    with pytest.raises(rumo.PlantError, match=r"At t = 0.\d+ s") as caught:
        scenario(plant=escape, x=[0.0, 5.0], disturbances={}, estimator=None, faults=()).run()
    again = pickle.loads(pickle.dumps(caught.value))
    assert str(again) == str(caught.value)
    xr.testing.assert_identical(again.log, caught.value.log)
    xr.testing.assert_identical(load(save(again.log, tmp_path / "run.nc")), again.log)


class Tiring:
    """Does what it is, until it has had enough: a reference, an estimator, a plant."""

    states, inputs = {"angle": "rad", "rate": "rad/s"}, {"torque": "N m"}

    def __init__(self, patience=3):
        self.patience = patience

    def tire(self, result):
        self.patience -= 1
        if self.patience < 0:
            raise ZeroDivisionError("enough")
        return result

    def preview(self, times, x):
        return self.tire(Preview({"angle": 0.0}))

    def start(self, problem, measured=None, discretization=None):
        return self

    def update(self, measured, applied, parameters):
        return self.tire(Estimate(measured))

    def advance(self, x, u, p):
        return self.tire(x)


class Spoiling(faults.Fault):
    def sense(self, received, past, bad, signals):
        raise ZeroDivisionError("enough")


@pytest.mark.parametrize(
    ("changes", "samples"),
    [
        ({"reference": Tiring()}, 3),
        ({"estimator": Tiring()}, 3),
        ({"plant": Tiring(), "disturbances": {}}, 4),
        ({"faults": (Spoiling(range(3, 4)),)}, 3),
    ],
)
def test_whatever_is_raised_comes_with_the_log_so_far(changes, samples):
    with pytest.raises(ZeroDivisionError, match="enough") as caught:
        scenario(**changes).run()
    assert caught.value.log.sizes["time"] == samples
    assert caught.value.log.attrs["complete"] == "no"
    assert "complete" not in scenario().run().attrs


class Careless:
    """An estimator that works on what it is given, and hands out its own memory."""

    def start(self, problem, measured=None, discretization=None):
        self.x = np.zeros(2)
        return self

    def update(self, measured, applied, parameters):
        measured *= 2.0
        self.x += 0.1
        return Estimate(self.x)


def test_estimators_may_work_in_place():
    for k, sample in enumerate(list(ClosedLoop(scenario(estimator=Careless(), faults=(), sensors=Sensors())))):
        np.testing.assert_array_equal(sample.measured, sample.plant)
        np.testing.assert_allclose(sample.estimated, 0.1 * (k + 1))


def test_samples_cannot_be_written_to():
    for sample in ClosedLoop(scenario()):
        for name in ("plant", "measured", "received", "estimated", "applied", "disturbance", "states", "outputs"):
            assert not getattr(sample, name).values.flags.writeable, name


def test_names_are_looked_up():
    problem = pendulum(
        model=rumo.registry.MODELS["van_der_pol"](),
        track={"position": rumo.Weight(1.0)},
        moves={"force": rumo.Weight(0.1)},
        bounds=None,
    )
    run = Scenario(
        problem,
        "van_der_pol",
        [2.0, 0.0],
        {"position": 1.6, "speed": 0.0},
        0.2,
        controller="ltv",
        discretization="radau2",
    )
    assert run.run().attrs["controller"] == "ltv"
    assert isinstance(ClosedLoop(run).controller.transcription.discretization, rumo.Radau2)
    assert ClosedLoop(replace(run, controller="rti", backend="reference")).controller.name == "rti"


class Mine(rumo.LinearTimeVarying):
    """A controller of one's own."""

    name = "mine"


def test_classes_of_ones_own_control():
    assert scenario(controller=Mine, reference={"angle": 0.1, "rate": 0.0}).run().attrs["controller"] == "mine"


class Told:
    """An estimator that answers the same, whatever is measured."""

    def __init__(self, answer):
        self.answer = answer

    def start(self, problem, measured, discretization):
        return self

    def update(self, measured, applied, parameters):
        return self.answer

    def sample(self, times, rng):
        return self.answer


class NeverStarted:
    def start(self, problem, measured, discretization):
        pass


def test_faults_may_be_a_list():
    assert scenario(faults=[faults.Missing(range(2))]).faults == (faults.Missing(range(2)),)


def test_what_is_given_may_change_afterwards():
    given = {"x": np.array([0.3, 0.0]), "applied": np.array([0.2]), "disturbances": {}}
    run = scenario(**given)
    given["x"][:] = given["applied"][:] = np.nan
    given["disturbances"]["gravity"] = OrnsteinUhlenbeck(1.0, 0.5, 0.3)
    np.testing.assert_array_equal(run.x, [0.3, 0.0])
    np.testing.assert_array_equal(run.applied, [0.2])
    assert not run.disturbances


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"plant": "van_der_pole"}, r"plant: got 'van_der_pole'.* Did you mean 'van_der_pol'\?"),
        ({"plant": Plant}, "plant: got <class"),
        ({"discretization": "radau9"}, r"discretization: got 'radau9'.* Did you mean 'radau3'\?"),
    ],
)
def test_names_are_looked_up_at_once(changes, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        scenario(**changes)


@pytest.mark.parametrize("bad", [faults.Missing((0.1, 0.2)), None])
def test_simulate_checks_faults(bad):
    run = scenario()
    with pytest.raises(rumo.ArgumentError, match=r"faults: got .* expected a tuple"):
        rumo.simulate(run.make_controller(), run.plant, run.x, run.reference, 0.1, faults=bad)


def test_clocks_may_differ_by_rounding():
    problem = pendulum(sampling_time=0.3, horizon=rumo.Grid([0.1 + 0.2] * 12))
    assert problem.uniform
    plant = Plant(problem.model, 0.1 + 0.2)
    assert Scenario(problem, plant, [0.1, 0.0], {"angle": 0.1}, 0.1 + 0.2).run().sizes["time"] == 1
    late = pendulum(sampling_time=0.1 + 0.2)
    assert ClosedLoop(Scenario(late, plant, [0.1, 0.0], {"angle": 0.1}, 0.3), rumo.RealTimeIteration(problem))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"controller": "rit"}, r"controller: got 'rit', expected one of rti, nlp, ltv. Did you mean 'rti'\?"),
        ({"controller": rumo.Weight}, "controller: got <class 'rumo.terms.Weight'>, expected one of rti"),
        ({"controller": "nlp", "backend": "portable"}, "backend: got 'portable', expected nothing: DirectNlp has only"),
        ({"duration": 0.01}, "duration: got 0.01, expected at least one sampling time"),
        ({"duration": "1"}, "duration: got '1', expected at least one sampling time"),
        ({"sensors": {"angle": 0.1}}, "sensors: got"),
        ({"estimator": 3}, "estimator: got 3, expected settings such as"),
        (
            {"reference": lambda t, x: {"angle": 0.0}},
            r"reference: got a function of \(t, x\), expected a function of times alone. What depends",
        ),
        ({"estimator": NeverStarted()}, r"estimator.start\(\): got None, expected an object with update\("),
        (
            {"estimator": Told([0.1, 0.0])},
            r"estimator.update\(\): got \[0.1, 0.0\], expected an Estimate. Write return",
        ),
        (
            {"estimator": Told(Estimate(np.zeros(3)))},
            r"estimator.update\(\).x: got shape \(3,\), expected shape \(2,\)",
        ),
        ({"estimator": Told(Estimate(np.zeros(2), np.zeros(2)))}, r"estimator.update\(\).covariance: got shape \(2,\)"),
        ({"disturbances": {"gravity": 9.0}}, r"disturbances\['gravity'\]: got 9.0, .* Write Constant\(9.0\)\."),
        ({"disturbances": {"gravity": Gust}}, r"disturbances\['gravity'\]: got <class"),
        (
            {"disturbances": {"gravity": Told([1.0, 2.0])}},
            r"gravity'\].sample\(\): got shape \(2,\), expected shape \(10,\)",
        ),
        ({"disturbances": {"gravity": Told(np.nan)}}, r"gravity'\].sample\(\): got NaN or infinity"),
        ({"reference": Following(SinePath())}, "position: got 'p_x', expected one of angle, rate"),
        (
            {"reference": lambda t: {"angle": math.sin(t)}},
            r"reference: got one that .* Write np.sin\(t\), not math.sin",
        ),
        (
            {"reference": Following(lambda t: {"angle": math.sin(t)}, ("angle",))},
            r"path: got one that .* Write np.sin\(t\), not math.sin",
        ),
        ({"reference": lambda t: {"angle": None}}, r"reference\['angle'\]: got None, expected numbers"),
        ({"reference": lambda t: {"angle": 1.0 if t > 1.0 else 0.0}}, r"reference: got one that .* np.where\(t < 1.0"),
        ({"sensors": Sensors(measured=("angle",)), "estimator": None}, "measured: got no rate, expected all states"),
        ({"sensors": Sensors(measured=("angle",))}, "noise: got 'rate', expected one of angle"),
        ({"reference": lambda t: {"angel": 0.0 * t}}, r"reference: got 'angel', .* Did you mean 'angle'\?"),
        ({"reference": {"angel": 0.0}}, r"reference: got 'angel', .* Did you mean 'angle'\?"),
        (
            {"sensors": Sensors(late={"angle": 2}), "estimator": None},
            r"sensors.late\['angle'\]: got 2, expected the 0 sam",
        ),
        (
            {"sensors": Sensors(late={"angle": 2}), "estimator": Butterworth()},
            "got 2, expected the 0 samples that estimator and problem",
        ),
        ({"sensors": Sensors(late={"angle": 2})}, r"got 2, expected the 0 .*ExtendedKalman\(late={...}\) takes late"),
        (
            {"estimator": ExtendedKalman({}, {}, late={"angle": 1})},
            r"sensors.late\['angle'\]: got 0, expected the 1 sam",
        ),
        ({"problem": 3}, "problem: got 3, expected a rumo.Problem"),
    ],
)
def test_mistakes(changes, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        list(ClosedLoop(replace(scenario(), **changes)))
