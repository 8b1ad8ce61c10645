"""`rumo drive`, as a user types it."""

import json

import pytest
from typer.testing import CliRunner

import rumo
from rumo.cli.app import app
from rumo.references import TRACKS
from rumo.simulation import Plant, load

runner = CliRunner(env={"COLUMNS": "100", "RUMO_BACKEND": "portable"})


@pytest.fixture
def track(tmp_path):
    """A straight of 40 m, as a file."""
    file = tmp_path / "straight.csv"
    file.write_text("x_m,y_m,w_tr_right_m,w_tr_left_m\n" + "".join(f"{5 * i},0,4,4\n" for i in range(9)))
    return file


def test_a_drive_writes_all_it_promises(tmp_path, track):
    folder = tmp_path / "out"
    result = runner.invoke(app, ["drive", "--track", str(track), "--output", str(folder)])
    assert result.exit_code == 0, result.output
    figures = {"path", "g-g", "friction-use", "deviations", "inputs", "step-time"}
    assert {path.name for path in folder.iterdir()} == {
        *(f"{figure}.{ending}" for figure in figures for ending in ("png", "pdf")),
        *("summary.json", "report.html", "log-rti.nc"),
    }
    summary = json.loads((folder / "summary.json").read_text())
    assert (summary["study"], summary["track"], summary["outcome"]) == ("drive", "straight", "finished")
    words = " ".join(result.stdout.split())
    assert f"Lateral deviation, RMS {summary['kpis']['lateral_deviation_rms_m']:#.3g} m" in words
    assert summary["ended"] in words
    assert "rti (m): 100 %" in result.stderr
    assert load(folder / "log-rti.nc").attrs["outcome"] == "finished"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--track", "clab"], "Did you mean 'club'?"),
        (["--vehicle", "race"], "Did you mean 'racer'?"),
        (["--track", "nosuch.csv"], "which is not there"),
        (["--plant", "commonroad-mb:9"], "expected commonroad-mb:1, commonroad-mb:2 or commonroad-mb:3"),
    ],
)
def test_mistakes_are_one_sentence_and_exit_code_2(tmp_path, arguments, message):
    result = runner.invoke(app, ["drive", *arguments, "--output", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert message in result.output
    assert "Traceback" not in result.output
    assert not (tmp_path / "out").exists()


@pytest.fixture
def undrawn(monkeypatch):
    """Figures take most of the time of a short drive."""
    monkeypatch.setattr("rumo.report.figures.write_figures", lambda *_: None)


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (rumo.PlantError, 2, "then: At t = 0.24 s: the road ended."),
        (KeyboardInterrupt, 130, "then: interrupted."),
    ],
)
def test_what_was_driven_is_reported_whatever_ended_it(tmp_path, monkeypatch, track, error, code, said):
    advance, samples = Plant.advance, iter(range(100))

    def failing(self, x, u, p):
        if next(samples) == 6:
            raise error("the road ended")
        return advance(self, x, u, p)

    monkeypatch.setattr(Plant, "advance", failing)
    result = runner.invoke(app, ["drive", "--track", str(track), "--output", str(tmp_path / "out")])
    assert result.exit_code == code
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert (summary["complete"], summary["outcome"]) == (False, "broken off")
    assert summary["kpis"]["status_counts"] == {"OPTIMAL": 7}
    assert summary["ended"].startswith("Broken off after ")
    assert f"Incomplete: 0 of 1 runs were done, {said}" in result.stdout
    assert load(tmp_path / "out" / "log-rti.nc").attrs["complete"] == "no"


@pytest.mark.usefixtures("undrawn")
def test_a_lost_car_is_a_result(tmp_path):
    """At more than the grip there is, it does not get through a bend that begins where it starts."""
    oval = TRACKS["oval"]().path
    points = oval.at([*range(95, 260, 5)])
    file = tmp_path / "bend.csv"
    file.write_text(
        "x_m,y_m,w_tr_right_m,w_tr_left_m\n"
        + "".join(f"{x},{y},4,4\n" for x, y in zip(points.x.tolist(), points.y.tolist(), strict=True))
    )
    arguments = ["--track", str(file), "--grip", "4.0", "--estimator", "none", "--output", str(tmp_path), "--json"]
    result = runner.invoke(app, ["drive", *arguments])
    assert result.exit_code == 0
    summary = json.loads(result.stdout)
    assert summary["outcome"] == "lost"
    assert summary["ended"].startswith("Lost at s = ")
