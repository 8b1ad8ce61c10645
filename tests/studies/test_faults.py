"""Bad samples in a row: what they do to a car, and how a study of thousands of drives is run."""

import json
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from typer.testing import CliRunner

import rumo
import rumo.simulation.faults
from rumo.cli.app import app
from rumo.report.figures import draw
from rumo.report.plots import plot
from rumo.studies.faults import BASE, FAULTS, FaultStudy, Trouble
from rumo.studies.faults.outcome import BACK, outcome
from rumo.studies.faults.report import faults_table
from rumo.studies.faults.summary import together

LOST = ("none", "nan", "infinite", "jump", "spin", "frozen", "missing", "failure", "budget")
"""The controller notices, and drives on with what it had before."""
SHORT = FaultStudy(faults=("none", "nan", "jump", "frozen", "failure", "budget"), duration=4.2, keep_logs=True)
LONGER = FaultStudy(("rti",), LOST, keep_logs=True)
CASES = {
    "rti portable": ("portable", LONGER),
    "rti reference": ("reference", replace(SHORT, controllers=("rti",))),
    "nlp": ("portable", replace(SHORT, controllers=("nlp",))),
    "rti reference, long": ("reference", LONGER),
    "nlp, long": ("portable", replace(LONGER, controllers=("nlp",))),
}
LONG = ("rti reference", "rti reference, long", "nlp, long")
cases = pytest.mark.parametrize("case", [pytest.param(k, marks=pytest.mark.slow) if k in LONG else k for k in CASES])
cases_and_faults = pytest.mark.parametrize(
    ("case", "fault"),
    [
        pytest.param(case, fault, marks=[pytest.mark.slow] if case in LONG else [])
        for case, (_, study) in CASES.items()
        for fault in study.faults
    ],
)
BAD_MEASUREMENTS = ("nan", "infinite", "jump", "spin", "frozen", "missing")
LIMIT = 0.10  # [m], as long as nothing else is said
LIMITS = {"jump": 0.15}


class Drives(dict):
    """Drives of a case by fault, each driven when it is asked for."""

    def __init__(self, backend, study):
        super().__init__()
        self.backend, self.study, self.runs = backend, study, study.runs()

    def __missing__(self, fault):
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("RUMO_BACKEND", self.backend)
            self[fault] = self.runs[self.study.controllers[0], fault, 8.0, 5, 0].run()
        return self[fault]

    def all(self):
        """All of them."""
        return {fault: self[fault] for fault in self.study.faults}


@pytest.fixture(scope="module")
def drives():
    return {case: Drives(*settings) for case, settings in CASES.items()}


@cases_and_faults
def test_commands_stay_in_bounds_nothing_raises_and_the_next_good_sample_is_solved(drives, case, fault):
    drive = drives[case][fault]
    result = drive.outcome
    assert (result["bad_commands"], result["exceptions"], result["samples_to_recover"]) == (0, 0, 1), drive.exception
    assert (result["lost"], result["recovery_s"]) == (False, 0.0)
    # Whatever else was wrong with the car, it is back where it would have been.
    undisturbed = drives[case]["none"].log.plant.sel(plant_state=["p_x", "p_y"]).values[-1]
    assert np.hypot(*(drive.log.plant.sel(plant_state=["p_x", "p_y"]).values[-1] - undisturbed)) < 0.05


@cases_and_faults
def test_the_largest_error_stays_below_its_limit(drives, case, fault):
    assert drives[case][fault].outcome["largest_error_m"] <= LIMITS.get(fault, LIMIT)


@cases
def test_statuses_say_what_happened(drives, case):
    bad = FaultStudy().bad(5)
    for fault, drive in drives[case].all().items():
        status = drive.log.status.values
        assert set(status[: bad.start]) | set(status[bad.stop :]) == {"OPTIMAL"}, fault
        if fault in BAD_MEASUREMENTS:
            whole = fault in ("frozen", "missing")  # else one reading of nine is predicted, and told as such
            assert set(status[bad.start : bad.stop]) == {"BAD_MEASUREMENT" if whole else "OPTIMAL"}, fault
            assert (drive.outcome["told"], drive.outcome["told_after_s"]) == (True, 0.0)
    assert not drives[case]["none"].outcome["told"]
    in_failure = set(drives[case]["failure"].log.status.values[bad.start : bad.stop])
    # IPOPT needs many iterations to find that there is no solution, sometimes more than it may take.
    assert in_failure == {"SOLVER_FAILED"} if "nlp" not in case else in_failure <= {"SOLVER_FAILED", "BUDGET_EXCEEDED"}
    in_budget = set(drives[case]["budget"].log.status.values[bad.start : bad.stop])
    # Where no bound is active, the C core's working set is right from the start and needs no iteration.
    assert in_budget == {"OPTIMAL" if case == "rti portable" else "BUDGET_EXCEEDED"}


def test_the_faults_are_what_they_are_called(drives):
    logs = {fault: drive.log for fault, drive in drives["rti portable"].all().items()}
    first, end = FaultStudy().bad(5).start, FaultStudy().bad(5).stop
    for log in logs.values():
        good = np.r_[0:first, end : log.sizes["time"]]
        np.testing.assert_array_equal(log.estimated.values[good], log.measured.values[good])

    def difference(fault, name):
        log = logs[fault].isel(time=slice(first, end)).sel(state=name)
        return log.estimated.values - log.measured.values

    np.testing.assert_allclose(difference("jump", "p_y"), 100.0)
    assert np.isnan(difference("nan", "psi")).all()
    assert np.isposinf(logs["infinite"].estimated.sel(state="v_x").values[first:end]).all()
    assert (logs["spin"].estimated.sel(state="omega").values[first:end] == 50.0).all()
    assert np.isnan(logs["missing"].estimated.values[first:end]).all()
    assert (logs["frozen"].estimated.values[first:end] == logs["frozen"].measured.values[first - 1]).all()


def test_the_undisturbed_drive_starts_on_its_path(drives):
    log = drives["rti portable"]["none"].log
    assert log.plant.sel(plant_state=["p_x", "p_y"]).values[0].tolist() == [0.0, 0.0]
    assert log.sizes["time"] == 200
    assert log.attrs["first_bad_sample"] == 75
    assert log.attrs["bad_samples"] == 5


def outcomes(study):
    """Outcomes of a study's drives with one speed, number of bad samples and seed, by fault."""
    results = study.run()[study.controllers[0]]
    return {fault: drive.outcome for fault in study.faults for drive in leaves(results[fault])}


def leaves(tree):
    """Drives of nested results."""
    return [leaf for branch in tree.values() for leaf in leaves(branch)] if isinstance(tree, dict) else [tree]


def test_without_the_gate_the_jump_loses_the_car():
    result = outcomes(FaultStudy(("rti",), ("jump",), gate=None))["jump"]
    assert result["largest_error_m"] > 10.0
    assert (result["lost"], result["recovery_s"]) == (True, None)
    assert (result["bad_commands"], result["exceptions"]) == (0, 0)


def test_other_seeds_recover_as_well():
    study = FaultStudy(("rti",), BAD_MEASUREMENTS, seeds=(1, 2), duration=4.8)
    drives = leaves(study.run())
    assert len(drives) == 2 * len(BAD_MEASUREMENTS)
    for drive in drives:
        result = drive.outcome
        assert (result["bad_commands"], result["exceptions"], result["samples_to_recover"]) == (0, 0, 1)
        assert result["largest_error_m"] <= LIMIT


@pytest.mark.slow
@pytest.mark.parametrize("speed", [8.0, 11.0])
def test_every_fault_leaves_finite_commands_and_raises_nothing(speed):
    """However wrong what is measured, told and driven is, whatever becomes of the car."""
    study = FaultStudy(("rti",), speeds=(speed,), samples=(25,), start=1.8, duration=3.4)
    for fault, result in outcomes(study).items():
        assert (result["bad_commands"], result["exceptions"]) == (0, 0), (fault, result["exception"])


def test_a_controller_that_raises_is_a_result(monkeypatch):
    class Bomb(rumo.simulation.faults.Fault):
        def around(self, controller):
            raise ZeroDivisionError("no")

    monkeypatch.setitem(FAULTS, "bomb", Trouble("A bomb", lambda bad, drive: Bomb(bad)))
    study = FaultStudy(("rti",), ("none", "bomb"), duration=3.4, keep_logs=True)
    drives = study.run()
    content = study.summary(drives)["controllers"]["rti"]["bomb"]
    assert (content["exceptions"], content["lost"], content["largest_error_m"]) == (1, 1, {"5": None})
    json.dumps(content, allow_nan=False)
    row = faults_table(study.summary(drives)["controllers"]["rti"]).rows[1]
    assert row == ["A bomb", "-", "1/1", "0", "1", "-", "0/1"]
    (drive,) = leaves(drives["rti"]["bomb"])
    assert drive.outcome["exception"] == "ZeroDivisionError: no"
    assert drive.log.sizes["time"] == study.bad(5).start


def test_an_interrupted_drive_says_when_its_fault_was():
    def progress(done, _):
        if done == 3:
            raise KeyboardInterrupt

    study = FaultStudy(("rti",), ("nan",))
    with pytest.raises(KeyboardInterrupt) as caught:
        study.runs()["rti", "nan", 8.0, 5, 0].run(progress=progress)
    attributes = {"fault": "NaN in a state", "first_bad_sample": 75, "bad_samples": 5, "complete": "no"}
    assert caught.value.log.attrs.items() >= attributes.items()


def test_bad_commands_and_late_recovery_are_counted(drives):
    log = drives["rti portable"]["none"].log.copy(deep=True)
    log["status"] = log.status.astype("U20")
    log.commanded.values[10, 0] = np.nan
    log.commanded.values[11, 1] = 1.6
    log.status.values[82] = "SOLVER_FAILED"
    result = outcome(log)
    assert result["bad_commands"] == 2
    assert result["samples_to_recover"] == 4  # samples 75 to 79 are bad, 83 is the first after which all is well
    assert (result["told"], result["told_after_s"]) == (False, None)  # only after the bad samples
    log.status.values[-1] = "SOLVER_FAILED"
    log.status.values[77] = "BUDGET_EXCEEDED"
    result = outcome(log)
    assert result["samples_to_recover"] is None
    assert (result["told"], result["told_after_s"]) == (True, pytest.approx(0.08))


def test_a_car_is_back_when_it_stays_near_its_path(drives):
    log = drives["rti portable"]["none"].log.copy(deep=True)
    p_y = log.plant.sel(plant_state="p_y").values
    for sample, recovery in ((78, 0.0), (80, 0.08), (90, 0.48)):  # 79 is the last bad one
        moved = log.copy(deep=True)
        moved.plant.loc[{"plant_state": "p_y"}] = np.where(np.arange(200) == sample, p_y + 2.0, p_y)
        result = outcome(moved)
        assert result["recovery_s"] == pytest.approx(recovery)
        assert 1.0 < result["largest_error_m"] < 3.0
        assert not result["lost"]
    moved.plant.loc[{"plant_state": "p_y"}] = np.where(np.arange(200) >= 199, p_y + 2.0 * BACK, p_y)
    assert outcome(moved)["recovery_s"] is None


@pytest.mark.parametrize(
    ("name", "change", "lost"), [("p_y", 9.0, 0), ("p_y", 11.0, 1), ("psi", 1.3, 0), ("psi", 2, 1)]
)
def test_a_car_is_lost_when_it_is_far_away_or_turned(drives, name, change, lost):
    log = drives["rti portable"]["none"].log.copy(deep=True)
    log.plant.loc[{"plant_state": name}][100] += change
    assert outcome(log)["lost"] == lost


def test_drives_through_a_fault_are_taken_together():
    study = FaultStudy(("rti",), ("near",), (8.0, 11.0), (1, 5), (0, 1), duration=4.0)
    tree = study.run()["rti"]["near"]
    every = {(v, n, s): drive.outcome for v in tree for n in tree[v] for s, drive in tree[v][n].items()}
    assert list(every) == [(v, n, s) for v in (8.0, 11.0) for n in (1, 5) for s in (0, 1)]
    result = together(tree)
    assert result["drives"] == 8
    assert sum(result["status_counts"].values()) == 8 * 100
    for count in (1, 5):
        largest = max(each["largest_error_m"] for (_, n, _), each in every.items() if n == count)
        assert result["largest_error_m"][str(count)] == largest
    assert result["lost"] == sum(each["lost"] for each in every.values())
    assert len({each["largest_error_m"] for each in every.values()}) == 8


def test_a_table_says_who_never_came_back():
    study = FaultStudy(("rti",), ("none", "zero", "heavy"), gate=None, duration=4.0)
    rows = faults_table(study.summary(study.run())["controllers"]["rti"]).rows
    assert [row[-2] for row in rows] == ["0.00", "never", "-"]
    assert [row[1:3] for row in rows[::2]] == [[rows[0][1], "-"], ["-", rows[2][2]]]


def test_what_does_not_come_and_go_is_there_for_the_whole_drive():
    study = FaultStudy(("rti",), ("heavy", "ice"), samples=(1, 5), duration=4.0)
    runs = study.runs()
    assert [key[3] for key in runs] == ["whole", 1, 5]
    faults = {key[1]: run.scenario.faults[0] for key, run in runs.items()}
    assert (faults["heavy"].when, faults["ice"].when) == (range(100), range(75, 80))


def test_the_whole_car_is_measured_for_its_noise():
    """Each measured signal has thirty times the noise that it had, as far as chance allows."""
    run = FaultStudy(("rti",), ("noise",), samples=(25,), duration=4.2).runs()["rti", "noise", 8.0, 25, 0]
    (fault,) = run.scenario.faults
    usual = rumo.Sensors(BASE.noise).deviations(run.scenario.problem.model.states)
    states = run.scenario.problem.model.states
    for name, deviation in zip(states, usual, strict=True):
        own = BASE.noise["w_fl"] / np.sqrt(2.0) if name in ("w_f", "w_r") else deviation
        assert np.hypot(fault.noise[name], own) == pytest.approx(30.0 * own)


def test_print_and_page_show_the_same():
    study = FaultStudy(("rti", "ltv"), ("none", "near", "heavy"), samples=(1, 5), start=0.4, duration=1.0)
    report = study.report(study.run())
    (content,) = report.figures
    assert [title for title, _ in content.panels] == ["RTI", "LTV"]
    assert [name for _, name in content.names] == ["No fault", "Position off by 5 m", "Mass +20 %"]
    printed, interactive = draw(content), plot(content)
    assert [tick.get_text() for tick in printed.axes[0].get_yticklabels()] == [name for _, name in content.names]
    assert list(interactive.layout.yaxis.ticktext) == [name for _, name in content.names]
    traces = iter(interactive.data)
    errors = report.summary["controllers"]
    for axes, (title, lines) in zip(printed.axes, content.panels, strict=True):
        assert [line.name for line in lines] == ["1 sample", "5 samples", "whole drive"]
        of = errors[title.lower()]
        for line, key in zip(lines, ("1", "5", "whole"), strict=True):
            known = [run["largest_error_m"].get(key) for run in of.values()]
            assert line.x.tolist() == [error for error in known if error is not None]
        for drawn, line in zip(axes.lines, reversed(lines), strict=True):
            np.testing.assert_array_equal(drawn.get_xdata(), line.x)
            assert drawn.get_linestyle() == "None"
            trace = next(traces)
            np.testing.assert_array_equal(trace.x, line.x)
            assert trace.mode == "markers"


def test_bad_samples_are_counted_in_those_of_the_drive():
    study = FaultStudy(base=replace(BASE, sampling_time=0.08), start=3.0)
    assert study.bad(5) == range(38, 43)
    assert "after 3.04 s come 5 bad samples" in study.report({}).lead
    with pytest.raises(rumo.ArgumentError, match=r"expected at least 3\.52 s, to see"):
        replace(study, duration=3.5)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"controllers": ("rti", "pid")}, "controllers: got 'pid', expected one of rti, nlp, ltv."),
        ({"controllers": ()}, "controllers: got none, expected some of rti, nlp, ltv."),
        ({"faults": ("jmp",)}, "Did you mean 'jump'?"),
        ({"samples": (0,)}, "samples: got 0, expected a whole number of at least 1."),
        ({"samples": ()}, "samples: got (), expected at least one number of samples such as 5."),
        ({"samples": 5}, "samples: got 5, expected at least one number of samples such as 5."),
        ({"speeds": (8.0, -1.0)}, "speeds: got -1.0, expected a positive finite number."),
        ({"speeds": ()}, "speeds: got (), expected at least one speed such as 8.0."),
        ({"seeds": (1.5,)}, "seeds: got 1.5, expected a whole number of at least 0."),
        ({"seeds": ()}, "seeds: got (), expected at least one seed such as 0."),
        ({"start": 0.0}, "start: got 0 s, expected at least one sample of 0.04 s."),
        ({"duration": 3.0}, "duration: got 3 s, expected at least 3.24 s, to see a good sample again."),
    ],
)
def test_bad_settings(settings, message):
    with pytest.raises(rumo.ArgumentError) as error:
        FaultStudy(**settings)
    assert message in str(error.value)


EARLY = ("--start", "0.4")
"""What goes wrong does so soon, so that drives may be short."""


def command(*options):
    """What `rumo study faults` comes to."""
    return CliRunner(env={"COLUMNS": "120"}).invoke(app, ["study", "faults", *map(str, options)])


def test_the_command_writes_all_it_promises(tmp_path, monkeypatch):
    monkeypatch.setattr("rumo.studies.faults.FaultStudy", partial(FaultStudy, duration=0.8))
    result = command("--controllers", "rti", *EARLY, "--output", tmp_path)
    assert result.exit_code == 0, result.output
    names = {"largest-error.png", "largest-error.pdf", "results.jsonl", "summary.json", "report.html"}
    assert {path.name for path in tmp_path.iterdir()} == names
    content = json.loads((tmp_path / "summary.json").read_text())
    assert (content["study"], content["first_bad_sample"], content["bad_samples"]) == ("faults", 10, [5])
    assert content["gate"] == {"width": rumo.InnovationGate().width, "patience": rumo.InnovationGate().patience}
    assert list(content["controllers"]["rti"]) == list(FAULTS)
    for fault in FAULTS.values():
        assert fault.title in result.output
    page = (tmp_path / "report.html").read_text()
    assert page.count('class="plotly-graph-div"') == 1
    assert 'src="http' not in page


OF = ("--controllers", "rti", "--faults", "none,near", *EARLY)
SOME = (*OF, "--speeds", "8,11", "--samples", "1,5", "--seeds", "0-1")


@pytest.fixture
def short(monkeypatch):
    """Drives of a second; counts those that are driven in this process."""
    driven = []
    run = rumo.studies.faults.FaultRun.run
    monkeypatch.setattr("rumo.studies.faults.FaultStudy", partial(FaultStudy, duration=1.0))
    monkeypatch.setattr(
        rumo.studies.faults.FaultRun, "run", lambda self, **how: driven.append(self) or run(self, **how)
    )
    return driven


def test_options_choose_what_is_driven_and_logs_are_kept_if_wanted(tmp_path, short):
    result = command(*SOME, "--logs", "--json", "--output", tmp_path)
    assert result.exit_code == 0, result.output
    content = json.loads(result.stdout)
    assert (content["speeds_m_s"], content["bad_samples"], content["seeds"]) == ([8.0, 11.0], [1, 5], [0, 1])
    assert [run["drives"] for run in content["controllers"]["rti"].values()] == [8, 8]
    assert len(short) == 16
    logs = {
        f"log-rti-{f}-{v}-{n}-{s}.nc" for f in ("none", "near") for v in (8.0, 11.0) for n in (1, 5) for s in (0, 1)
    }
    assert {path.name for path in tmp_path.glob("log-*")} == logs


def test_processes_drive_as_one_does(tmp_path, short):
    one = json.loads(command(*SOME, "--json", "--output", tmp_path / "one").stdout)
    two = json.loads(command(*SOME, "--json", "--jobs", "2", "--output", tmp_path / "two").stdout)
    assert one == two
    assert len(short) == 16  # all of the first


def test_an_interrupted_study_goes_on(tmp_path, short):
    some = (*OF, "--seeds", "0-3", "--json", "--output", tmp_path)
    whole = json.loads(command(*some).stdout)
    file = tmp_path / "results.jsonl"
    lines = file.read_bytes().splitlines(keepends=True)
    assert len(lines) == 1 + 8
    file.write_bytes(b"".join(lines[:6]) + b'{"key": ["rti", "no')
    short.clear()
    assert json.loads(command(*some, "--resume").stdout) == whole
    assert len(short) == 3
    assert file.read_bytes().splitlines(keepends=True)[:6] == lines[:6]
    # A study of more goes on as well; without --resume all is driven anew.
    short.clear()
    more = json.loads(command(*some, "--faults", "none,near,far", "--resume").stdout)["controllers"]["rti"]
    assert {fault: more[fault] for fault in ("none", "near")} == whole["controllers"]["rti"]
    assert len(short) == 4
    short.clear()
    command(*some)
    assert len(short) == 8


def test_results_of_other_settings_are_not_taken_for_these(tmp_path, short):
    assert command(*SOME, "--quiet", "--output", tmp_path).exit_code == 0
    result = command(*SOME, "--no-gate", "--resume", "--output", tmp_path)
    assert result.exit_code == 2
    assert "--resume: got" in result.output
    assert "of another gate" in result.output
    assert "Leave --resume out to begin anew" in result.output
    assert (tmp_path / "summary.json").exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--faults", "swaped"), "--faults: got 'swaped'"),
        (("--speeds", "fast"), "--speeds: got 'fast', expected numbers such as 8 or 8,11"),
        (("--samples", "1,2.5"), "--samples: got '2.5', expected numbers such as 5, 1,5,25 or 0-9"),
        (("--seeds", "0-x"), "--seeds: got '0-x', expected numbers such as"),
        (("--speeds", "-8"), "speeds: got -8.0, expected a positive finite number"),
        (("--samples", "0"), "samples: got 0, expected a whole number of at least 1"),
        (("--seeds", "9-0"), "seeds: got (), expected at least one seed"),
        (("--start", "0"), "start: got 0 s, expected at least one sample"),
    ],
)
def test_wrong_options_are_said(tmp_path, options, message):
    result = command(*options, "--output", tmp_path)
    assert result.exit_code == 2
    assert message in " ".join(result.output.split())
