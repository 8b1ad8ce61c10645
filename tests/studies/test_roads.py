"""Cars on the road: short runs of small cases, goals, the table, and what is left out."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

import rumo
from rumo.cli.app import app
from rumo.references.manoeuvres import iso_3888_2
from rumo.report.figures import draw
from rumo.studies.base import carry_out, nested
from rumo.studies.roads import CASES, Conditions, Goal, RoadStudy, Row
from rumo.studies.roads.cases.moose import is_clean, least_room, speed_at
from rumo.studies.roads.outcome import RoadDrive, log_of
from rumo.studies.roads.report import findings, goals_table
from rumo.studies.roads.rows import largest, median, share
from rumo.vehicles import PASSENGER_CAR
from rumo.vehicles.parameters import GRAVITY

SHORT = RoadStudy(("sine-12", "tracks"), ("rti", "nlp"), seeds=(0,), tracks=("eight",), nlp_distance=15.0)


@pytest.fixture(scope="module")
def driven():
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RUMO_BACKEND", "portable")
        runs = {key: run for key, run in SHORT.runs().items() if key[:2] != ("sine-12", "nlp")}
        return {key: SHORT.restored(json.loads(json.dumps(SHORT.record(drive)))) for key, drive in carry_out(runs)}


def test_short_runs_reach_their_goals(driven):
    content = SHORT.summary(nested(driven))
    json.dumps(content, allow_nan=False)
    rows = {(case, name): found for case, each in content["cases"].items() for name, found in each["rows"].items()}
    assert set(rows) == {("sine-12", "rti"), ("tracks", "rti"), ("tracks", "nlp")}
    missed = {row["figure"] for found in rows.values() for row in found if row["met"] is False}
    # A lap of nothing but bends, out of which no car accelerates as a profile says.
    assert missed <= {"Lateral deviation, RMS, largest", "Lap time over the profile's, longest"}
    assert all(row["met"] for row in rows["sine-12", "rti"])
    assert rows["tracks", "nlp"][0]["figure"] == "First 15 m finished"
    assert rows["tracks", "rti"][0]["figure"] == "Laps finished"


def test_figures_are_those_of_the_motion_that_is_kept(driven):
    motion = driven["sine-12", "rti", 0].motion
    point = CASES["sine-12"].scene(0, SHORT.conditions)[0].path.at(12.0 * motion.time.values)
    x, y = (motion.plant.sel(plant_state=name).values for name in ("p_x", "p_y"))
    error = np.hypot(x - point.x, y - point.y)[motion.time.values >= 2.0]
    rms = driven["sine-12", "rti", 0].outcome["position_rms_m"]
    assert rms == pytest.approx(np.sqrt(np.mean(error**2)), abs=1e-5)


def test_the_report_shows_each_case(driven):
    report = SHORT.report(nested(driven))
    assert [figure.key for figure in report.figures] == [
        f"{case}-{what}" for case in ("sine-12", "tracks") for what in ("path", "deviations")
    ]
    for figure in report.figures:
        draw(figure).draw_without_rendering()
    table = goals_table(report.summary["cases"])
    assert all(re.fullmatch(r"-|[0-9.]+(, met|, MISSED)?", cell) for row in table.rows for cell in row[4:])
    assert findings(report.summary)[-1] == "RTI loses no drive that NLP holds."


@pytest.mark.parametrize("name", CASES)
def test_rti_and_nlp_share_their_drives(name):
    if CASES[name].lacking:
        pytest.skip("needs what is not installed")
    keys = list(RoadStudy((name,)).runs())
    by_controller = {
        controller: [key[2] for key in keys if key[1] == controller] for controller in CASES[name].controllers
    }
    assert by_controller["rti"] == by_controller["nlp"]
    assert len(keys) == len(set(keys)) == len(by_controller) * len(by_controller["rti"])
    assert all(key[0] == name for key in keys)


@pytest.mark.parametrize("name", CASES)
def test_every_case_says_what_it_is(name):
    case, conditions = CASES[name], Conditions()
    assert case.title
    assert case.told.endswith(".")
    if not case.lacking:
        variant = case.variants(conditions)[0]
        road, _ = case.scene(variant, conditions)
        assert road.path.length > 0.0
        assert case.variant_words(variant)


def test_bends_take_their_share_of_dry_friction():
    conditions = Conditions()
    for radius in CASES["ice"].variants(conditions):
        road, driven = CASES["ice"].scene(radius, conditions)
        profile = driven(None).profile
        most = np.abs(road.path.at(road.path.nodes).curvature).max() * profile.v.max() ** 2
        assert most == pytest.approx(0.6 * 0.9 * GRAVITY, rel=1e-6)


@pytest.mark.parametrize(
    ("y", "room"),
    [(0.0, 0.5 * (0.1 * PASSENGER_CAR.width + 0.25)), (0.1, 0.5 * (0.1 * PASSENGER_CAR.width + 0.25) - 0.1)],
)
def test_cones_are_compared_with_the_corners_of_the_car(y, room):
    """Straight ahead through the first lane, and on into the cones of the second."""
    change = iso_3888_2(PASSENGER_CAR.width)
    motion = {"sampling_time_s": 0.04, "p_x": [0.0, 8.0], "p_y": [y, y], "psi": [0.0, 0.0]}
    _, driven = CASES["moose"].scene(0, Conditions())
    assert least_room(driven(log_of(motion))) == pytest.approx(room)
    through = motion | {"p_x": [0.0, 30.0]}
    beyond = change.lanes[1].right - (y - 0.5 * PASSENGER_CAR.width)
    assert least_room(driven(log_of(through))) == pytest.approx(-beyond)
    assert speed_at(driven(log_of(motion)), 1e3) is None
    assert not is_clean(RoadDrive({"outcome": "lost", "least_room_m": None}))


def test_a_moose_test_ends_with_the_first_cone():
    case = replace(CASES["moose"], slowest=30, fastest=34, steps=(3,))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RUMO_BACKEND", "portable")
        found = case.drive("rti", 0, Conditions())
    assert (found.outcome["entry_km_h"], found.outcome["touched_at_km_h"]) == (33, None)
    assert found.outcome["left_at_km_h"] == pytest.approx(33.0, abs=1.0)
    none = {"entry_km_h": None}
    assert [row.met for row in case.rows("rti", {0: none, 1: found.outcome}, Conditions())] == [None, False]


def test_edges_of_the_small_track_do_not_cross():
    road, _ = CASES["racer"].scene(0, Conditions())
    s = np.linspace(0.0, road.path.length, 2000)
    bends = np.abs(road.path.at(s).curvature).max()
    assert 0.5 * sum(float(width) for width in road.track.limits(0.0)) * bends < 1.0
    points = road.path.at(s[::10])
    near = np.hypot(points.x[:, None] - points.x, points.y[:, None] - points.y)
    along = np.abs(s[::10, None] - s[::10])
    along = np.minimum(along, road.path.length - along)
    assert near[along > 20.0].min() > 5.0


def test_what_is_missing_counts_as_missed():
    outcomes = {"a": {"outcome": "finished", "x": 1.0}, "b": {"outcome": "lost", "x": None}}
    assert largest(outcomes, "x") == (None, "b")
    assert median(outcomes, "x") is None
    assert median(outcomes | {"c": {"outcome": "finished", "x": 3.0}}, "x") == 3.0
    assert share(outcomes, "finished") == (50.0, "1 of 2, not b")
    assert Row("x", None, "m", Goal(1.0)).met is False
    assert Row("x", None, "m").met is None
    assert (Goal(1.0).met(1.0), Goal(1.0).met(1.1), Goal(1.0, at_least=True).met(0.9)) == (True, False, False)


def test_findings_name_what_only_the_rti_loses():
    ended = {"finished": {"outcome": "finished"}, "lost": {"outcome": "lost"}}
    drives = {"rti": {"a": ended["lost"], "b": ended["lost"]}, "nlp": {"a": ended["finished"], "b": ended["lost"]}}
    rows = {name: [Row("Held", 50.0, "%", Goal(100.0, at_least=True), "1 of 2").content] for name in drives}
    content = {"cases": {"x": {"title": "X", "told": "", "rows": rows, "drives": drives}}, "left_out": {}}
    assert findings(content) == [
        "RTI meets 0 of 1 goals; it misses X: held 50.0 % (1 of 2).",
        "Direct NLP meets 0 of 1 goals; it misses X: held 50.0 % (1 of 2).",
        "RTI loses, where NLP does not: X, a.",
    ]
    drives["nlp"]["a"] = ended["finished"] | {"whole": False}
    assert findings(content)[-1] == "RTI loses no drive that NLP holds."


def test_cases_that_cannot_be_driven_are_left_out_with_a_sentence(monkeypatch):
    sentence = "Not driven: commonroad-vehicle-models is not here."
    monkeypatch.setattr(type(CASES["multi-body"]), "lacking", sentence)
    study = RoadStudy(("multi-body",))
    assert not study.runs()
    assert any(text.endswith(sentence) for text in findings(study.report({}).summary))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"cases": ("sin-12",)}, "cases: got 'sin-12', .* Did you mean 'sine-12'?"),
        ({"cases": ()}, "cases: got none, expected some of sine-12"),
        ({"controllers": ("pid",)}, "controllers: got 'pid', expected one of rti, nlp, ltv."),
        ({"seeds": ()}, "seeds: got none, expected at least one"),
        ({"seeds": (-1,)}, "seeds: got -1"),
        ({"tracks": ()}, "tracks: got none, expected at least one name or file."),
        ({"tracks": ("ovl",)}, "track: got 'ovl', .* Did you mean 'oval'?"),
        ({"tracks": ("oval", "there/oval.csv")}, "tracks: got 'oval' more than once"),
        ({"nlp_distance": 0.0}, "nlp_distance: got 0.0"),
    ],
)
def test_misuse(settings, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        replace(SHORT, **settings)


def test_the_command_goes_on_where_it_was(tmp_path, monkeypatch):
    monkeypatch.setenv("RUMO_BACKEND", "portable")
    out = tmp_path / "out"
    command = ["study", "roads", "--cases", "tracks", "--controllers", "nlp", "--tracks", "eight"]
    command += ["--nlp-distance", "3", "--seeds", "0", "--output", str(out), "--quiet"]
    assert CliRunner().invoke(app, command).exit_code == 0
    first = (out / "results.jsonl").read_bytes()
    assert CliRunner().invoke(app, [*command, "--resume"]).exit_code == 0
    assert (out / "results.jsonl").read_bytes() == first
    assert json.loads((out / "summary.json").read_text())["cases"]["tracks"]["drives"]["nlp"]["eight"]["whole"] is False
    empty = tmp_path / "empty"
    empty.mkdir()
    result = CliRunner().invoke(app, ["study", "roads", "--tracks", str(empty), "--output", str(out)])
    assert result.exit_code == 2
    assert "a folder without CSV files" in result.stderr.replace("\n", " ")
