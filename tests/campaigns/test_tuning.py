"""A tuning from its first trial to its report, with drives that are made up."""

import json
import shutil

import pytest
from fake_tuning import BASE, RMS, TORQUE, arguments, drive, tuned

from rumo.campaigns.store import read_head, read_rows
from rumo.campaigns.tuning import Tuning
from rumo.campaigns.tuning.reading import tuning_of
from rumo.campaigns.tuning.report import report
from rumo.errors import ArgumentError, CampaignError
from rumo.report.figures import write_figures
from rumo.report.page import write_page
from rumo.scenarios import Recipe

pytest.importorskip("optuna")
pytest.importorskip("pyarrow")
pytestmark = pytest.mark.usefixtures("quick_disks")


@pytest.fixture(scope="module")
def whole(tuning, tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole") / "tune"
    return (*tuned(tuning, folder), folder)


def tells_its_rows(tuning, folder):
    """From what its folder keeps, each row is known as the drive that it is of."""
    told = tuning_of(read_head(folder)["specification"])
    for row in read_rows(folder).to_dict("records"):
        drives, chosen = told.drives_of(row)
        assert drives.task(row["draw"], tuning.controller, chosen)["key"] == row["key"]


def test_every_row_tells_which_drive_it_is_of(tuning, whole):
    tells_its_rows(tuning, whole[2])
    row = read_rows(whole[2]).iloc[0].to_dict() | {"setting.filter_cutoff": 4.0}
    with pytest.raises(ArgumentError, match=r"of a run that is now another one.* as they were repeat it"):
        tuning.drives_of(row)


def test_what_is_found_is_better_and_within_the_limit(tuning, whole):
    found, engine, folder = whole
    assert len(found.trials) == 24
    assert found.trials[0].settings == BASE
    (best,) = found.best
    mean = sum(1.0 + 0.01 * (seed % 7) for seed in (100, 101, 102)) / 3
    weight, cutoff = best.settings["problem.weights.p_y"], best.settings["filter_cutoff"]
    assert best.values[0] == pytest.approx(mean * (0.1 + 0.2 / weight + 0.02 * abs(cutoff - 6.0)))
    assert 1.5 < weight <= 6.5  # 1.5 times 1.1 is the torque of 6.5
    assert best.values[0] == min(trial.values[0] for trial in found.trials if trial.feasible)
    assert len(found.judged.before) == len(found.judged.after) == 12
    assert len(engine.driven) == len({*engine.driven}) == 3 * (1 + 24) + 2 * 12
    assert len(read_rows(folder)) == len(engine.driven)
    assert Recipe.from_toml(folder / "best.toml") == tuning.recipe.with_settings(best.settings) == found.recipe


@pytest.mark.parametrize("most", [0, 2, 3, 10, 41, 76, 90])
def test_interrupted_it_goes_on_to_the_same(most, tuning, whole, tmp_path):
    folder = tmp_path / "tune"
    if most < 3:  # drives without tuning
        with pytest.raises(KeyboardInterrupt):
            tuned(tuning, folder, most=most)
    else:
        stopped, _ = tuned(tuning, folder, most=most)
        assert isinstance(stopped.stopped, KeyboardInterrupt)
        assert stopped.trials == whole[0].trials[: len(stopped.trials)]
        assert report(stopped, folder).summary["complete"] is False
    found, engine = tuned(tuning, folder)
    assert found.trials == whole[0].trials
    assert found.importance == whole[0].importance
    assert len(engine.driven) == len(whole[1].driven) - most
    assert report(found, "tune").summary == report(whole[0], "tune").summary
    again, engine = tuned(tuning, folder)
    assert engine.driven == []
    assert again.best == found.best


def test_with_more_trials_it_goes_on(tuning, whole, tmp_path):
    shutil.copytree(whole[2], tmp_path / "tune")
    more = Tuning(**{**arguments(tuning), "trials": 32})
    found, engine = tuned(more, tmp_path / "tune")
    assert found.trials[:24] == whole[0].trials
    assert len(found.trials) == 32
    assert len(engine.driven) in (24, 36)  # the check again, if a better one was found


def test_drives_that_fail_do_not_end_it(tuning, tmp_path):
    def failing(settings):
        weight = settings.get("problem.weights.p_y", 1.0)
        if weight > 20.0:
            return "crashed", "signal 11 (SIGSEGV)"
        if weight > 10.0:
            return "timeout", "not done after 60 s"
        if weight > 5.0:
            return "raised", "PlantError: lost"
        return {"kpi.fallbacks": 1} if weight < 0.3 else drive(settings)

    found, _ = tuned(tuning, tmp_path / "tune", failing)
    failed = [trial for trial in found.trials if not trial.values]
    assert len(found.trials) == 24
    assert failed
    assert found.best
    content = report(found, "tune").summary
    assert content["trials"]["failed"] == len(failed)
    assert {each["outcome"] for each in content["failures"]} <= {"crashed", "timeout", "raised"}
    assert sum(each["drives"] for each in content["failures"]) == len(found.failed)
    assert all({*BASE, "seed"} == {*each["settings"]} for each in content["failures"])


@pytest.mark.parametrize(
    ("of", "message"),
    [
        (lambda settings: ("raised", "PlantError: lost"), "objectives.error asks. raised: PlantError: lost"),
        (lambda settings: {f"kpi.{RMS}": 1.0, "kpi.input_variation_per_s.brake": 1.0}, r"they have .*\.brake"),
        (lambda settings: {f"kpi.{RMS}": float("nan")}, "objectives.error asks"),
    ],
)
def test_without_drives_to_compare_with_there_is_no_tuning(of, message, tuning, tmp_path):
    with pytest.raises(CampaignError, match=message):
        tuned(tuning, tmp_path / "tune", of)


def test_a_folder_has_one_tuning(tuning, whole):
    other = Tuning(**arguments(tuning, sampler="random"))
    with pytest.raises(ArgumentError, match=r'of another campaign: tune\.sampler was "tpe", is "random", expected'):
        tuned(other, whole[2])


def test_two_objectives_have_a_front(tuning, tmp_path):
    goals = {"error": {"kpi": RMS}, "calm": {"kpi": TORQUE, "of": "max"}}
    two = Tuning(**arguments(tuning, objectives=goals, limits={}, sampler="nsga2", trials=60))
    found, _ = tuned(two, tmp_path / "tune")
    assert len(found.best) > 3
    assert {path.name for path in (tmp_path / "tune").glob("best*.toml")} == {
        "best.toml",
        *(f"best-{trial.number}.toml" for trial in found.best[1:]),
    }
    costs = [trial.values for trial in found.best]
    assert found.best[0].values not in (min(costs), max(costs))  # in the middle of the front
    shown = report(found, "tune")
    assert "front-error-calm" in {figure.key for figure in shown.figures}
    assert len(shown.summary["best"]) == len(found.best)


def test_more_may_be_better_and_less_may_be_the_limit(tuning, tmp_path):
    goals = {"error": {"kpi": RMS, "maximise": True}}
    most = Tuning(**arguments(tuning, objectives=goals, limits={"least": {"kpi": TORQUE, "at_least": 1.3}}))
    found, _ = tuned(most, tmp_path / "tune")
    (best,) = found.best
    assert best.settings["problem.weights.p_y"] > 2.5
    assert best.values[0] == max(trial.values[0] for trial in found.trials if trial.feasible)


def test_where_nothing_is_within_the_limits_nothing_is_best(tuning, tmp_path):
    none = Tuning(**arguments(tuning, limits={"torque": {"kpi": TORQUE, "at_most": 0.5}}))
    found, _ = tuned(none, tmp_path / "tune")
    assert found.recipe is None
    assert found.judged is None
    assert not (tmp_path / "tune" / "best.toml").exists()
    assert "None of the 24 trials is within the limits" in report(found, "tune").sections[0].content[0]


def test_what_was_best_already_is_said_to_be(tuning, tmp_path):
    found, _ = tuned(
        Tuning(**arguments(tuning, trials=8)), tmp_path / "tune", lambda told: drive({"seed": told["seed"]})
    )
    gained, *others = report(found, "tune").sections
    assert gained.content[0] == "None of the 8 trials is better than the settings as they were."
    assert "The best settings" not in [section.heading for section in others]


def test_lists_and_whole_numbers_can_be_searched(tuning, tmp_path):
    search = {"horizon": [5, 10, 15], "estimator": ["butterworth", "none"], "problem.weights.p_y": range(1, 9)}
    listed = Tuning(**arguments(tuning, search=search, limits={}))

    def of(settings):
        return drive({"seed": settings["seed"], "filter_cutoff": settings.get("horizon", 10) / 2})

    found, _ = tuned(listed, tmp_path / "tune", of)
    assert found.trials[0].settings == {"horizon": 15, "estimator": "butterworth", "problem.weights.p_y": 1}
    assert type(found.best[0].settings["horizon"]) is int
    tells_its_rows(listed, tmp_path / "tune")
    shown = report(found, "tune")
    heads = [item.heads[0] for section in shown.sections for item in section.content if hasattr(item, "heads")]
    assert "estimator" in heads


def test_the_report_says_what_was_gained(whole, tmp_path):
    shown = report(whole[0], "tune")
    json.dumps(shown.summary, allow_nan=False)
    error, torque = shown.summary["objectives"]["error"], shown.summary["limits"]["torque"]
    assert error["check"]["ratio"] == pytest.approx(error["check"]["after"] / error["check"]["before"])
    low, high = error["check"]["interval"]
    assert low < error["check"]["difference"] < high < 0.0
    assert torque["tuning"]["at_most"] == pytest.approx(1.5 * torque["tuning"]["before"])
    assert torque["check"]["held_after"] is True
    assert "Error: mean RMS error after 2 s over 12 drives that it did not know" in str(shown.sections[0].content[0])
    write_page(tmp_path / "report.html", shown)
    write_figures(shown.figures, tmp_path)
    assert {"history-error.png", "over-settings-error.png"} <= {path.name for path in tmp_path.glob("*.png")}
    assert len((tmp_path / "report.html").read_bytes()) < 2_000_000
