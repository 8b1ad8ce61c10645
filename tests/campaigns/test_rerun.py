"""What a campaign's folder keeps: read again, compared, and its runs made again, bit for bit."""

import json

import pytest
from typer.testing import CliRunner

from rumo.campaigns import work
from rumo.campaigns.judging.kept import read_results
from rumo.campaigns.rerun import Rerun, rerun_report
from rumo.campaigns.specification import Campaign
from rumo.campaigns.store import Store
from rumo.cli.app import app
from rumo.scenarios import Recipe
from rumo.simulation import load

pytest.importorskip("pyarrow")
runner = CliRunner(env={"COLUMNS": "120"})
CRITERIA = {"close": {"kpi": "tracking_error_rms_m", "at_most": 0.5}}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Of a small campaign, one of whose runs is missing."""
    place = tmp_path_factory.mktemp("campaigns") / "small"
    recipe = Recipe("paper", {"duration": 1.0})
    campaign = Campaign(recipe, {"speed": [6.0, 8.0, 10.0]}, criteria=CRITERIA)
    with Store(place, campaign.plain) as store:
        for task in list(campaign.tasks)[:2]:
            settings = {f"setting.{name}": value for name, value in task["settings"].items()}
            decided = {name: task[name] for name in ("key", "draw", "controller")}
            store.add({**work.run(campaign.common, task), **decided, **settings})
        store.flush()
    return place


def test_results_are_those_that_were_kept(folder):
    results = read_results(folder)
    assert (len(results.rows), results.asked, results.name) == (2, 3, "small")
    assert results.criteria[0].plain == CRITERIA["close"]
    assert results.varied == ("speed",)


def test_a_run_is_made_again_bit_for_bit(folder, tmp_path):
    row = read_results(folder).rows.iloc[1]
    result = runner.invoke(app, ["rerun", str(folder), row["key"][:9], "--output", str(tmp_path / "again")])
    assert result.exit_code == 0, result.output
    assert "It came to what its row says, bit for bit." in result.stdout
    summary = json.loads((tmp_path / "again" / "summary.json").read_text())
    assert (summary["key"], summary["same"], summary["settings"]["speed"]) == (row["key"], True, row["setting.speed"])
    assert summary["kpis"]["tracking_error_rms_m"] == row["kpi.tracking_error_rms_m"]
    assert load(tmp_path / "again" / f"{row['key']}.nc").attrs["seed"] == row["setting.seed"]


def test_what_was_made_otherwise_is_named_where_figures_differ():
    made = {"run.backend": "tailored", "run.numpy": "2.0.1", "run.casadi": "3.6.0", "run.host": "a"}
    row = {"outcome": "done", "kpi.fallbacks": 0.0, **made}

    def told(**before):
        found = Rerun("1f", "rti", 0, {}, None, None, row, {**row, **before}, ())
        return found.told, rerun_report(found).summary

    assert told()[0] == "It came to what its row says, bit for bit."
    assert told(**{"run.numpy": "1.26"})[0] == "It came to what its row says, bit for bit."
    other = {"kpi.fallbacks": 1.0}
    assert told(**other)[0].endswith("Versions, build of the core and machine are the same, as far as its row says.")
    words, content = told(**other, **{"run.backend": "portable", "run.numpy": "1.26", "run.casadi": None})
    assert words == (
        "Not what its row says: kpi.fallbacks came to another value. "
        "It was not made with the same: numpy was 1.26, is 2.0.1; backend was portable, is tailored."
    )
    assert content["environment"]["backend"] == {"then": "portable", "now": "tailored"}


@pytest.mark.parametrize(("key", "message"), [("zz", "expected the key of one of 2 runs"), ("", "the key of one of 2")])
def test_a_key_of_no_run_says_so(folder, key, message):
    result = runner.invoke(app, ["rerun", str(folder), key])
    assert (result.exit_code, message in " ".join(result.output.split())) == (2, True)


def test_campaigns_are_compared_from_their_folders(folder, tmp_path):
    result = runner.invoke(app, ["compare", str(folder), str(folder), "--output", str(tmp_path / "out")])
    assert result.exit_code == 0, result.output
    assert "Nothing that the campaigns were told" in result.stdout
    result = runner.invoke(app, ["compare", str(folder), str(tmp_path), "--output", str(tmp_path / "out")])
    assert (result.exit_code, "campaign.json" in result.output) == (2, True)
