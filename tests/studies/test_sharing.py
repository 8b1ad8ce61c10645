"""Controllers that are there already drive as new ones do, to the last bit."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from problems import pendulum

import rumo
from rumo.simulation import Scenario, Sensors
from rumo.studies.paper import PaperStudy
from rumo.studies.sharing import shared_controller

CHANGES = {
    "weights": {"weights": {"angle": 7.0, "torque": 0.03}},
    "ranges": {"ranges": {"angle": 0.2}},
    "bounds": {"bounds": {"torque": (-0.7, 0.9), "rate": (-0.8, 0.8)}},
    "moves": {"move_bounds": {"torque": (-0.3, 0.3)}},
    "limits": {"limits": {"cone": -0.1}},
    "hard": {"penalties": {"rate": None}},
    "penalties": {"penalties": {"rate": rumo.Penalty(0.01, 0.3)}},
    "safe input": {"safe_input": {"torque": 0.2}},
    "parameters": {"parameters": {"gravity": 6.0}},
}


def swing(**changes):
    """A pendulum whose limits matter, with noise and a failure."""
    problem = pendulum(
        bounds={"torque": (-2.0, 2.0), "rate": rumo.Bounds(-2.0, 2.0, rumo.Penalty(10.0))},
        move_bounds={"torque": (-1.5, 1.5)},
        constraints={"cone": rumo.Constraint(lambda x, u, p: x.angle - 2.0 * x.rate - 0.4, rumo.Penalty(5.0))},
    )
    scenario = Scenario(
        problem,
        problem.model,
        [0.4, 0.0],
        {"angle": -0.1, "rate": 0.0},
        1.2,
        backend=changes.pop("backend", None),
        sensors=Sensors({"angle": 0.01, "rate": 0.01}),
        faults=(rumo.faults.Missing(range(8, 11)), rumo.faults.Budget(range(14, 15), 0)),
    )
    return replace(scenario, **changes)


def without_times(log):
    return log.drop_vars([name for name in log.data_vars if name.endswith("_time")])


def same(scenario):
    """A drive with a controller that is there already, and with one that is new."""
    shared = shared_controller(scenario)
    xr.testing.assert_identical(without_times(scenario.run(shared)), without_times(scenario.run()))
    return shared


def test_other_numbers():
    first = swing(backend="portable")
    controller, applied = same(first), []
    for changes in CHANGES.values():
        scenario = replace(first, problem=first.problem.changed(**changes))
        assert same(scenario) is controller
        applied.append(scenario.run(controller)["applied"].data)
    assert same(first) is controller
    assert sum(not np.array_equal(other, first.run(controller)["applied"].data) for other in applied) >= 6


@pytest.mark.parametrize("kind", [{"backend": "reference"}, {"controller": "ltv"}, {"controller": "nlp"}], ids=str)
def test_other_numbers_of_controllers_in_python(kind):
    first = swing(faults=(), duration=0.25, **kind)
    controller = same(first)
    for changes in (CHANGES["weights"], CHANGES["hard"], {}):
        assert same(replace(first, problem=first.problem.changed(**changes))) is controller


def test_problems_made_anew():
    """Other weights and another path give other objects, but the same equations."""
    controllers = set()
    for speed, weight in ((8.0, 1.0), (9.0, 1.0), (8.0, 3.0)):
        study = PaperStudy(("rti",), duration=0.4)
        study = replace(study, path=replace(study.path, speed=speed))
        scenario = study.runs()[("rti",)]
        scenario = replace(scenario, problem=scenario.problem.changed(weights={"p_y": weight}))
        controllers.add(same(scenario))
    assert len(controllers) == 1
    assert shared_controller(PaperStudy(("rti",), horizon=14).runs()[("rti",)]) not in controllers
    assert shared_controller(PaperStudy(("rti",), sampling_time=0.05).runs()[("rti",)]) not in controllers


def test_other_settings():
    first = swing(backend="portable")
    controller = same(first)
    for settings in ({"gate": None}, {"sqp_iterations": 3}, {"qp": rumo.QpOptions(max_iterations=2)}, None):
        assert same(replace(first, settings=settings)) is controller
    riccati = same(replace(first, settings={"qp": rumo.QpOptions(solver="riccati")}))
    assert riccati is not controller
    assert same(replace(first, settings={"rescue": rumo.DirectNlp}, faults=())) is not controller


def test_wrong_settings_are_named():
    with pytest.raises(rumo.UnknownNameError, match="settings: got 'gaet'"):
        shared_controller(swing(settings={"gaet": None}))


def test_what_a_run_has_left_behind_is_gone():
    scenario = swing(backend="portable")
    controller = shared_controller(scenario)
    controller.update(weights={"angle": 99.0})
    controller.configure(gate=None)
    assert same(scenario) is controller


def test_a_backend_by_the_environment_is_another_controller(monkeypatch):
    kinds = []
    for backend in ("portable", "reference", "portable"):
        monkeypatch.setenv("RUMO_BACKEND", backend)
        kinds.append(shared_controller(swing()).backend)
    assert kinds == ["portable", "reference", "portable"]
