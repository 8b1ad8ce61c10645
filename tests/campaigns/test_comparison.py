"""Two campaigns, and two drives: what differs, and in which pairs."""

import json

import numpy as np
import pytest
from campaign_rows import CLOSE, made_up
from typer.testing import CliRunner

import rumo
from rumo.campaigns.comparison import compare_campaigns, compare_drives
from rumo.campaigns.judging.criteria import Criterion
from rumo.campaigns.judging.results import Results
from rumo.cli.app import app
from rumo.report.page import figures_of, write_page
from rumo.simulation import load, save
from rumo.studies import PaperStudy
from rumo.studies.kpis import driving_kpis

CRITERIA = (Criterion("close", "tracking_error_max_after_2s_m", at_most=0.2),)
RMS = "tracking_error_rms_after_2s_m"
runner = CliRunner(env={"COLUMNS": "120"})


def changed(rows, factor=0.9):
    """The same draws in another order, with smaller errors, and keys of their own."""
    other = rows.sample(frac=1.0, random_state=1).reset_index(drop=True)
    other[CLOSE] *= factor
    other["key"] = ["f" + key[1:] for key in other["key"]]
    other["draw"] = -1 - other["draw"]
    return other


@pytest.fixture(scope="module")
def rows():
    return made_up(80)


def test_draws_are_paired_by_their_settings(tmp_path, rows):
    found = compare_campaigns(Results(rows, CRITERIA), Results(changed(rows), CRITERIA), ("before", "after"))
    for pair in found.summary["comparisons"]:
        figure = pair["kpis"]["tracking_error_max_after_2s_m"]
        mine = rows[rows["controller"] == pair["first"].removeprefix("before ").lower()]
        assert pair["second"] == pair["first"].replace("before", "after")
        assert (pair["draws"], figure["pairs"]) == (80, mine[CLOSE].notna().sum())
        assert figure["mean"] == pytest.approx(0.1 * mine[CLOSE].mean())
        assert figure["second_better"] == 1.0
        assert pair["kpis"][RMS]["largest"] == 0.0
        assert pair["criteria"]["close"]["first"] == 0
    write_page(tmp_path / "report.html", found)
    assert figures_of(tmp_path / "report.html") == [figure.key for figure in found.figures]
    json.dumps(found.summary, allow_nan=False)


def test_what_the_campaigns_were_told_is_compared(rows):
    told = [{"scenario": {"base": "paper", "problem.weights.p_y": weight}} for weight in (1.0, 2.0)]
    results = [Results(rows, CRITERIA, specification=each) for each in told]
    found = compare_campaigns(*results)
    assert found.summary["differs"] == {"scenario.problem.weights.p_y": [1.0, 2.0]}


def test_other_settings_are_not_paired_but_compared(rows):
    fewer = changed(rows).drop(columns="setting.mass")
    found = compare_campaigns(Results(rows, CRITERIA), Results(fewer, CRITERIA))
    (rti, _) = found.summary["unpaired"]
    assert [pair["draws"] for pair in found.summary["comparisons"]] == [0, 0]
    difference = rti["kpis"]["tracking_error_max_after_2s_m"]
    assert difference["mean"] == pytest.approx(0.1 * rows.query("controller == 'rti'")[CLOSE].mean())
    assert difference["interval"][0] < difference["mean"] < difference["interval"][1]


def test_one_controller_is_compared_with_another(rows):
    first, second = (Results(rows.query(f"controller == '{name}'"), CRITERIA) for name in ("rti", "ltv"))
    (pair,) = compare_campaigns(first, second, ("a", "b")).summary["comparisons"]
    assert (pair["first"], pair["second"], pair["draws"]) == ("a RTI", "b LTV", 80)
    with pytest.raises(rumo.ArgumentError, match="a controller that drives in both"):
        compare_campaigns(Results(rows), Results(rows.assign(controller="nlp")))


def test_criteria_of_the_same_name_that_ask_for_other_things_are_both_asked(rows):
    wider = (Criterion("close", "tracking_error_max_after_2s_m", at_most=0.3),)
    found = compare_campaigns(Results(rows, CRITERIA), Results(rows, wider))
    assert list(found.summary["criteria"]) == ["close", "close, second"]


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """Two drives of the paper's car, and where they are kept."""
    folder = tmp_path_factory.mktemp("logs")
    return [
        save(PaperStudy(("rti",), seed=seed, duration=duration).run()["rti"], folder / f"{seed}.nc")
        for seed, duration in ((0, 3.0), (1, 2.4))
    ]


def test_two_drives_are_compared_as_long_as_both_go_on(tmp_path, logs):
    first, second = (load(path) for path in logs)
    found = compare_drives(first, second)
    assert found.summary["differs"]["seed"] == [0, 1]
    one, other = found.summary["kpis"]["tracking_error_rms_m"]
    assert one == pytest.approx(driving_kpis(first)["tracking_error_rms_m"])
    assert one != other
    (difference,) = (figure for figure in found.figures if figure.key == "difference")
    title, (line,) = difference.panels[1]
    assert title == "p_y [m]"
    less = first["plant"].sel(plant_state="p_y")[:60].to_numpy() - second["plant"].sel(plant_state="p_y").to_numpy()
    np.testing.assert_array_equal(line.y, less)


def test_the_command_compares_logs(tmp_path, logs):
    result = runner.invoke(app, ["compare", *map(str, logs), "--output", str(tmp_path / "out")])
    assert result.exit_code == 0, result.output
    assert "Difference" in result.stdout
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["compared"] == ["0.nc", "1.nc"]
    assert (tmp_path / "out" / "report.html").is_file()


@pytest.mark.parametrize(
    ("second", "message"),
    [("nothing", "which is not there"), (".", "two campaigns, or two logs")],
)
def test_what_cannot_be_compared_is_one_sentence(tmp_path, logs, second, message):
    result = runner.invoke(app, ["compare", str(logs[0]), str(tmp_path / second), "--output", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert message in " ".join(result.output.split())
    assert not (tmp_path / "out").exists()
    (tmp_path / "campaign.json").write_text("{}")
    result = runner.invoke(app, ["compare", *map(str, logs), "--output", str(tmp_path)])
    assert (result.exit_code, "which is a campaign's" in result.output) == (2, True)
