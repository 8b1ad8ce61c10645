"""A campaign's report: what it says is so, whatever the rows are."""

import json
import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from campaign_rows import CLOSE, made_up
from scipy.stats import spearmanr

import rumo
from rumo.campaigns.judging.criteria import Criterion
from rumo.campaigns.judging.results import Results
from rumo.campaigns.judging.statistics import holm
from rumo.campaigns.judging.summary import summary
from rumo.campaigns.report import report
from rumo.report.charts import HeatMap, Panels
from rumo.report.contents import Command, Folded
from rumo.report.figures import draw
from rumo.report.page import figures_of, write_page
from rumo.report.plots import plot
from rumo.report.tables import Table
from rumo.simulation import save
from rumo.studies import PaperStudy

CRITERIA = (
    Criterion("close", "tracking_error_max_after_2s_m", at_most=0.3),
    Criterion("safe", "fallbacks", at_most=0),
)


def items(found):
    """All that sections show, also what is folded."""
    for section in found.sections:
        for item in section.content:
            yield item
            yield from item.content if isinstance(item, Folded) else ()


@pytest.fixture(scope="module")
def results():
    return Results(made_up(200), CRITERIA, ("rti", "ltv"), name="made up")


@pytest.fixture(scope="module")
def found(results):
    return report(results)


def test_shares_and_figures_are_those_of_the_rows(results, found):
    rows, rti = results.rows, found.summary["controllers"]["rti"]
    mine = rows[rows["controller"] == "rti"]
    passed = ((mine["outcome"] == "done") & (mine[CLOSE] <= 0.3)).sum()
    assert rti["criteria"]["close"]["passed"] == passed
    assert rti["criteria"]["close"]["share"] == passed / 200
    both = (mine["outcome"] == "done") & (mine[CLOSE] <= 0.3) & (mine["kpi.fallbacks"] <= 0)
    assert rti["all_criteria"]["passed"] == both.sum()
    assert rti["outcomes"] == mine["outcome"].value_counts().to_dict()
    known = mine[CLOSE].dropna()
    assert rti["kpis"]["tracking_error_max_after_2s_m"]["p95"] == pytest.approx(np.percentile(known, 95))
    assert rti["kpis"]["tracking_error_max_after_2s_m"]["known"] == len(known)
    assert rti["statuses"] == {"OPTIMAL": 600 * (mine["outcome"] == "done").sum()}
    assert json.loads(json.dumps(found.summary, allow_nan=False)) == found.summary


def test_dependence_is_spearmans_and_seeds_are_no_setting(results, found):
    mine = results.rows[results.rows["controller"] == "ltv"].dropna(subset=[CLOSE])
    said = found.summary["rank_correlations"]["tracking_error_max_after_2s_m"]
    assert said["plant.mu"]["ltv"]["rho"] == pytest.approx(spearmanr(mine["setting.plant.mu"], mine[CLOSE]).statistic)
    assert list(said) == ["speed", "mass", "plant.mu", "sensors.noise.p_x"]


def test_the_worst_are_the_worst_and_have_a_command(results, found):
    worst = results.rows.sort_values(CLOSE, ascending=False)["key"].head(10).tolist()
    assert [run["key"] for run in found.summary["worst"]] == worst
    commands = [item.text for item in items(found) if isinstance(item, Command)]
    assert commands == [f"rumo rerun FOLDER {key}" for key in worst]


def test_controllers_are_compared_on_the_same_draws(results, found):
    wide = results.rows.pivot_table(index="draw", columns="controller", values=CLOSE).dropna()
    (said,) = found.summary["comparisons"]
    figure = said["kpis"]["tracking_error_max_after_2s_m"]
    assert (said["first"], said["second"], figure["pairs"]) == ("rti", "ltv", len(wide))
    assert figure["mean"] == pytest.approx((wide["rti"] - wide["ltv"]).mean())
    assert figure["first_better"] == pytest.approx((wide["rti"] < wide["ltv"]).mean())
    farther = said["kpis"]["distance_m"]  # of which more is better
    assert farther["first_better"] == pytest.approx(0.5, abs=0.5)
    ahead = results.rows.pivot_table(index="draw", columns="controller", values="kpi.distance_m").dropna()
    assert farther["first_better"] == pytest.approx((ahead["rti"] > ahead["ltv"]).mean())


def test_what_stands_of_several_comparisons_is_said(results, found):
    (said,) = found.summary["comparisons"]
    chances = [each["chance"] for each in said["criteria"].values()]
    assert [each["corrected"] for each in said["criteria"].values()] == holm(chances)
    words = [item for item in items(found) if isinstance(item, str)]
    none = [item for item in words if "none stands" in item]
    assert len(none) == (min(holm(chances)) >= 0.05)
    assert sum("not corrected for their number" in item for item in words) == 1


def test_comparisons_in_which_nothing_differs_do_not_count():
    """What all controllers pass, or none, takes nothing from what may be found elsewhere."""
    rows = made_up(60)
    rows.loc[rows["controller"] == "ltv", CLOSE] += np.where(np.arange(60) % 5, 0.0, 9.0)
    close, all_pass, none = (
        Criterion(str(most), CLOSE.removeprefix("kpi."), at_most=most) for most in (2.0, 1e9, -1.0)
    )
    done = rows[rows.groupby("draw")["outcome"].transform(lambda each: (each == "done").all())]
    alone, among = (summary(Results(done, judged)) for judged in ((close,), (close, all_pass, none)))
    tests = among["comparisons"][0]["criteria"]
    assert tests["2.0"] == alone["comparisons"][0]["criteria"]["2.0"]
    assert tests["2.0"]["corrected"] == tests["2.0"]["chance"] < 0.05
    assert [(tests[name]["chance"], tests[name]["corrected"]) for name in ("1000000000.0", "-1.0")] == [(1.0, 1.0)] * 2


def test_what_no_drive_knows_is_said():
    known, lap = (
        report(Results(made_up(20), CRITERIA)),
        report(Results(made_up(20), (Criterion("lap", "lap_time_s", 9.0),))),
    )
    (words,) = [item for item in items(lap) if isinstance(item, str) and item.startswith("Lap, ")]
    assert words.count(", not known in any of them") == 2
    assert not [item for item in items(known) if isinstance(item, str) and "not known in any" in item]


def test_each_difference_is_told_from_0_and_no_more(found):
    (said,) = found.summary["comparisons"]
    low, high = said["kpis"]["tracking_error_max_after_2s_m"]["interval"]
    (words,) = [item for item in items(found) if isinstance(item, str) and item.startswith("RTI less LTV")]
    assert ("which includes 0" if low <= 0.0 <= high else "which leaves out 0") in words


GAUSS = {"distribution": "normal", "mean": 200.0, "std": 20.0}


@pytest.mark.parametrize(
    ("vary", "sampling", "said", "not_said"),
    [
        ({"mass": GAUSS}, "sobol", "Sobol's sequence are spread more evenly.*nothing guarantees", "grid"),
        ({"mass": GAUSS}, "latin-hypercube", "in a Latin hypercube are spread more evenly", "grid"),
        ({"mass": GAUSS}, "random", "made for independent draws.$", "grid|evenly"),
        (
            {"mass": GAUSS, "speed": [6.0, 8.0]},
            "sobol",
            "All points of the grid.*same values of mass.*too narrow",
            "drawn:",
        ),
        ({"seed": {"from": 0, "to": 3}}, "sobol", "Points of a grid were chosen and not drawn", "Sobol|mass"),
    ],
)
def test_what_wilsons_interval_is_made_for_is_said_once(results, vary, sampling, said, not_said):
    specification = {"campaign": {"sampling": sampling}, "vary": vary}
    page = report(replace(results, specification=specification))
    (words,) = [item for item in items(page) if isinstance(item, str) and "Wilson" in item]
    assert re.search(said, words)
    assert not re.search(not_said, words)


def test_settings_have_their_units(results):
    told = {"scenario": {"base": "paper"}}
    shown = [item for item in items(report(replace(results, specification=told))) if isinstance(item, Panels | Table)]
    titles = {title for item in shown if isinstance(item, Panels) for title, _ in item.panels}
    assert {"speed [m/s]", "mass [kg]", "plant.mu"} <= titles
    assert {"speed\n[m/s]", "plant.mu"} <= {head for item in shown if isinstance(item, Table) for head in item.heads}
    assert results.named("speed") == "speed"  # of a campaign that does not say what it is of


def test_the_heat_map_does_not_say_that_anything_depends(results):
    rows = results.rows.copy()
    rows[CLOSE] = np.random.default_rng(1).uniform(0.1, 0.5, len(rows))  # whatever the settings
    words = [item for item in items(report(replace(results, rows=rows))) if isinstance(item, str)]
    assert any("neither is clearly more than chance" in item for item in words)


def test_failures_are_told_by_kind(results, found):
    rows = results.rows
    for kind in found.summary["failures"]:
        mine = rows[rows["controller"] == kind["controller"]]
        if kind["outcome"] == "lost":
            assert kind["runs"] == mine["ended"].notna().sum()
        else:
            assert kind["runs"] == (mine["outcome"] == kind["outcome"]).sum()
        assert kind["key"] in set(mine["key"])
    failed = sum(kind["runs"] for kind in found.summary["failures"])
    assert failed == (rows["outcome"] != "done").sum() + rows["ended"].notna().sum()


def test_the_heat_map_shows_the_share_in_each_cell(results, found):
    (figure,) = (figure for figure in found.figures if isinstance(figure, HeatMap))
    assert (figure.x.label, figure.y.label) == ("speed", "plant.mu")
    for title, values, counts in figure.panels:
        mine = results.of({"RTI": "rti", "LTV": "ltv"}[title])
        assert counts.sum() == mine.sum()
        np.testing.assert_allclose(np.nansum(values * counts) / 100.0, results.passed[mine].sum())
    fast = results.rows["setting.speed"] == 10.0
    np.testing.assert_allclose(figure.panels[0][2][:, 2].sum(), (fast & results.of("rti")).sum())
    chosen = Results(results.rows, CRITERIA, heat_map=("mass", "speed"))
    (figure,) = (figure for figure in report(chosen).figures if isinstance(figure, HeatMap))
    assert (figure.x.label, figure.y.ticks) == ("mass", ("6", "8", "10"))
    assert len(figure.x.ticks) == figure.panels[0][1].shape[1] + 1  # edges of intervals
    with pytest.raises(rumo.UnknownNameError, match="Did you mean 'mass'"):
        Results(results.rows, CRITERIA, heat_map=("mas", "speed"))


def test_every_figure_can_be_drawn_on_the_page_and_in_print(tmp_path, found):
    write_page(tmp_path / "report.html", found)
    keys = figures_of(tmp_path / "report.html")
    assert keys == [figure.key for figure in found.figures]
    assert len(set(keys)) == len(keys)
    for figure in (each for each in found.figures if isinstance(each, HeatMap) or each.key == "pass-rates"):
        printed = draw(figure)
        printed.canvas.draw()
        assert len(plot(figure).data) >= len(figure.panels)


ALL_FAILED = made_up(30).assign(outcome="raised", error="ValueError: no", **{CLOSE: np.nan, "kpi.fallbacks": None})
CASES = {
    "20 runs of one": (made_up(20, ("rti",)), CRITERIA),
    "three": (made_up(40, ("rti", "ltv", "nlp")), CRITERIA),
    "no criteria": (made_up(40), ()),
    "all failed": (ALL_FAILED[[column for column in ALL_FAILED if column[:4] not in ("run.", "kpi.")]], CRITERIA),
    "one run": (made_up(1, ("rti",), failures=False), CRITERIA),
    "nothing varies": (made_up(20)[["key", "draw", "controller", "outcome", "error", CLOSE]], CRITERIA[:1]),
    "unknown controllers": (made_up(20, ("mine", "yours")), CRITERIA),
    "words as settings": (made_up(60).assign(**{"setting.track": ["club", "oval", "eight"] * 40}), CRITERIA),
    "unpaired": (made_up(60).query("(draw % 2 == 0) == (controller == 'rti')"), CRITERIA),
    "None and numbers": (made_up(30).astype(object).where(lambda rows: rows.notna(), None), CRITERIA),
}


@pytest.mark.parametrize("case", CASES)
def test_a_page_is_made_of_whatever_there_is(tmp_path, case):
    rows, criteria = CASES[case]
    found = report(Results(rows, criteria))
    write_page(tmp_path / "report.html", found)
    json.dumps(found.summary, allow_nan=False)
    text = " ".join(item for item in items(found) if isinstance(item, str))
    assert "nan" not in text.split()
    assert not any(
        "nan" in cell.split() for item in items(found) if isinstance(item, Table) for r in item.rows for cell in r
    )
    assert found.summary["runs"] == len(rows)


def test_many_runs_make_a_page_that_opens_at_once(tmp_path):
    rows = pd.concat([made_up(5_000, ("rti",), seed=i) for i in range(2)], ignore_index=True)
    rows["draw"] = np.arange(len(rows))
    found = report(Results(rows, CRITERIA))
    write_page(tmp_path / "report.html", found)
    assert (tmp_path / "report.html").stat().st_size < 2e6
    over = next(figure for figure in found.figures if figure.key.startswith("over-settings"))
    assert isinstance(over, Panels)
    assert rows[CLOSE].max() == pytest.approx(max(line.y.max() for _, lines in over.panels for line in lines), rel=1e-6)
    assert all(len(line.x) <= 600 for _, lines in over.panels for line in lines)
    assert "of 10,000 runs" in over.title


def test_worst_drives_are_shown_from_their_logs(tmp_path):
    rows = made_up(20, ("rti",), failures=False)
    results = Results(rows, CRITERIA, folder=tmp_path)
    keys = [run["key"] for run in summary(results)["worst"]]
    (tmp_path / "logs").mkdir()
    save(PaperStudy(("rti",), duration=2.0).run()["rti"], tmp_path / "logs" / f"{keys[0]}.nc")
    (tmp_path / "logs" / f"{keys[1]}.nc").write_bytes(b"torn")
    found = report(results)
    first, second, third = (item for item in list(items(found)) if isinstance(item, Folded) and item.open)
    assert [figure.key for figure in found.figures if keys[0] in figure.key] == [
        f"place-{keys[0]}",
        f"over-time-{keys[0]}-0",
    ]
    assert first.content[-1] == Command(f"rumo rerun {tmp_path} {keys[0]}")
    assert "Its log cannot be read" in second.content[0]
    assert "Its log was not kept" in third.content[0]


def test_a_campaign_that_was_broken_off_says_so(results):
    found = report(Results(results.rows, CRITERIA, asked=1000))
    assert found.warning.startswith("Incomplete: 400 of 1,000 runs are done.")
    assert not found.summary["complete"]


def test_what_is_no_table_of_rows_says_so():
    with pytest.raises(rumo.ArgumentError, match="a table without 'draw'"):
        Results(made_up(2).drop(columns="draw"))


def test_runs_by_different_builds_are_told(results):
    rows = results.rows.copy()
    rows["run.backend"] = ["portable" if who == "rti" else "numpy" for who in rows["controller"]]
    same = report(replace(results, rows=rows))
    assert same.summary["controllers"]["rti"]["builds"] == {"portable": 200}
    assert same.warning == ""  # what drives differs from one controller to another anyway
    rows.loc[rows.index[rows["controller"] == "rti"][:3], "run.backend"] = ["tailored", "tailored", None]
    mixed = report(replace(results, rows=rows))
    words = mixed.warning.replace("\u00a0", " ")
    assert (
        words
        == "Runs were driven by different builds of the core, whose last digits differ (RTI: 197 portable, 2 tailored)."
    )
