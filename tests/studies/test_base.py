"""What all studies promise: runs that can be done elsewhere, and a report of those that were done."""

import json
import pickle
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import active_children, get_context
from pathlib import Path
from time import sleep

import numpy as np
import pytest

import rumo
from rumo.report.contents import Report
from rumo.report.figures import draw
from rumo.report.page import write_page
from rumo.simulation import Constant, load, save
from rumo.studies import Drive, PaperStudy
from rumo.studies.base import carry_out, nested
from rumo.studies.discretization import CASES, DiscretizationStudy
from rumo.studies.estimation import EstimationStudy
from rumo.studies.faults import FaultStudy
from rumo.studies.linearization import LinearizationStudy
from rumo.studies.race_line import RaceLineStudy
from rumo.studies.sharing import shared_controller

STUDIES = {
    "paper": PaperStudy(("rti", "nlp"), duration=0.4),
    "faults": FaultStudy(("rti", "ltv"), ("none", "jump", "budget"), start=0.4, duration=0.8, keep_logs=True),
    "linearization": LinearizationStudy(("rti", "ltv"), {"speed": (8.0, 9.0), "noise": (1.0,)}, duration=0.4),
    "drive": Drive("oval", distance=15.0, backend="portable"),
    "estimation": EstimationStudy(("start",), ("ekf", "mhe"), (0,), 2.0, 5, Drive("oval", backend="portable")),
    "race-line": RaceLineStudy(("oval",), spacing=8.0),
    "discretization": DiscretizationStudy(("van-de-vusse",), ("implicit-euler", "radau2"), backend="portable"),
}


@pytest.mark.parametrize("name", STUDIES)
def test_settings_and_runs_are_data(name):
    study = STUDIES[name]
    assert pickle.loads(pickle.dumps(study)) == study
    runs = study.runs()
    assert list(pickle.loads(pickle.dumps(runs))) == list(runs)


@pytest.mark.parametrize("case", CASES)
def test_cases_are_data(case):
    made = CASES[case]()
    copy = pickle.loads(pickle.dumps(made))
    np.testing.assert_array_equal(copy.inputs(1.5), made.inputs(1.5))


def test_a_run_elsewhere_is_the_run_here():
    study = STUDIES["faults"]
    runs = study.runs()
    key = ("rti", "jump", 8.0, 5, 0)
    here = runs[key].run().log
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        there = pool.submit(runs[key].run).result().log
    for name in ("plant", "estimated", "commanded", "status"):
        np.testing.assert_array_equal(there[name].values, here[name].values)


@dataclass(frozen=True)
class Touching:
    """A run that leaves a file, and fails if it is told to."""

    path: Path
    fails: bool = False

    def run(self, *, progress=None):
        sleep(0.05)
        self.path.touch()
        if self.fails:
            raise ZeroDivisionError("no")
        return self.path.name


@pytest.mark.parametrize("fails", [False, True])
def test_processes_begin_nothing_more_once_they_are_stopped(tmp_path, fails):
    runs = {("some", i): Touching(tmp_path / str(i), fails and i == 1) for i in range(100)}
    carrying = carry_out(runs, jobs=2)
    if fails:
        with pytest.raises(ZeroDivisionError):
            dict(carrying)
    else:
        assert next(carrying)[1] in "0123"
        carrying.close()
    assert len(list(tmp_path.iterdir())) < 50
    assert not active_children()


def test_processes_do_all_that_there_is_to_do(tmp_path):
    runs = {(name, i): Touching(tmp_path / f"{name}{i}") for name in "ab" for i in range(4)}
    told = []
    done = dict(carry_out(runs, lambda *what: told.append(what), jobs=3))
    assert done == {key: f"{key[0]}{key[1]}" for key in runs}
    assert sorted(told) == [(name, i + 1, 4) for name in "ab" for i in range(4)]


@pytest.mark.parametrize("name", STUDIES)
@pytest.mark.parametrize("done", ["nothing", "one", "all but one"])
def test_a_report_says_what_it_can(name, done, tmp_path):
    study = STUDIES[name]
    results = dict(carry_out(dict(list(study.runs().items())[: {"nothing": 0, "one": 1}.get(done, -1)])))
    report = study.report(nested(results))
    assert isinstance(report, Report)
    assert report.summary["study"] == name
    json.dumps(report.summary, allow_nan=False)
    for figure in report.figures:
        draw(figure)
    write_page(tmp_path / "report.html", replace(report, warning="Incomplete"))
    assert "Incomplete" in (tmp_path / "report.html").read_text()


def test_a_value_of_a_sweep_is_reported_only_if_all_have_driven_it():
    study = STUDIES["linearization"]
    results = dict(list(carry_out(study.runs()))[:3])
    assert study.report(nested(results)).summary["sweeps"]["speed"]["values"] == [8.0]


def test_controllers_are_shared_by_what_they_are_made_of():
    run, other = list(STUDIES["faults"].runs().values())[:2]
    scenario = run.scenario
    controller = shared_controller(scenario)
    assert shared_controller(other.scenario) is controller
    assert shared_controller(replace(scenario, settings={"gate": rumo.InnovationGate(9.0)})) is controller
    for changes in ({"backend": "reference"}, {"controller": "ltv"}):
        assert shared_controller(replace(scenario, **changes)) is not controller


@pytest.mark.parametrize(
    "study",
    [FaultStudy(("rti",), ("none",), gate=None), LinearizationStudy(("rti", "nlp"), {"initial_error": (8.0,)})],
    ids=["faults", "linearization"],
)
def test_a_scenario_is_all_that_decides_a_run(study):
    for run in study.runs().values():
        made, shared = run.scenario.make_controller(), shared_controller(run.scenario)
        assert made.settings == shared.settings
        assert made.settings.gate is None


def test_a_seed_of_any_size_is_kept_in_a_log(tmp_path):
    log = PaperStudy(("rti",), seed=10**20, duration=0.08).run()["rti"]
    assert int(load(save(log, tmp_path / "run.nc")).attrs["seed"]) == 10**20


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, "in wind, with noisy, filtered measurements"),
        ({"estimator": None, "wind": Constant(3.0)}, "in wind, with noisy, unfiltered measurements"),
        ({"noise": {"p_x": 0.0}, "wind": Constant(0.0)}, "without wind, with exact, filtered measurements"),
    ],
)
def test_reports_say_what_was_driven(changes, words):
    assert words in PaperStudy(**changes).report({}).lead
    faults = FaultStudy(base=PaperStudy(**changes)).report({}).lead
    assert words.replace(" filtered", " unfiltered") in faults
