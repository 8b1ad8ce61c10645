"""Race lines: closed forms on a circle, and least time against what a speed profile makes of the line."""

import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

import rumo
from rumo.cli.app import app
from rumo.references import TRACKS, Path, SpeedLimits, Track, deviations, minimum_curvature, speed_profile
from rumo.report.figures import draw
from rumo.report.plots import plot
from rumo.studies.race_line import LINES, RaceLineStudy, minimum_time
from rumo.studies.race_line.report import finding, lines_table
from rumo.vehicles import PASSENGER_CAR

LIMITS = SpeedLimits.race(0.9, top=50.0, power=100.0, drag=4e-4)
RADIUS, WIDTH, MARGIN = 50.0, 5.0, 1.0
CIRCLE = Track(Path.from_curvature((0.0, 2.0 * np.pi * RADIUS), (1.0 / RADIUS,) * 2, closed=True), WIDTH, WIDTH)


def test_on_a_circle_least_time_is_inside_and_least_curvature_outside():
    """A radius r takes 2 pi sqrt(r / a), and has a curvature of 1 / r."""
    best = minimum_time(CIRCLE, LIMITS, MARGIN, spacing=4.0)
    inside = RADIUS - WIDTH + MARGIN
    assert best.outcome == "found"
    np.testing.assert_allclose(best.aside, WIDTH - MARGIN, atol=1e-3)
    assert best.duration == pytest.approx(2.0 * np.pi * np.sqrt(inside / LIMITS.lateral), rel=1e-3)
    np.testing.assert_allclose(best.speed, np.sqrt(LIMITS.lateral * inside), rtol=1e-3)
    line = minimum_curvature(CIRCLE, MARGIN)
    assert line.length == pytest.approx(2.0 * np.pi * (RADIUS + WIDTH - MARGIN), rel=1e-3)
    assert speed_profile(line, LIMITS).duration > best.duration


@pytest.fixture(scope="module")
def oval():
    track = TRACKS["oval"]()
    return track, minimum_time(track, LIMITS, 1.1, spacing=4.0)


def test_least_time_is_less_than_that_of_other_lines(oval):
    track, best = oval
    own = speed_profile(best.path, LIMITS).duration
    times = [own, speed_profile(minimum_curvature(track, 1.1), LIMITS).duration]
    times.append(speed_profile(track.path, LIMITS).duration)
    assert times == sorted(times)
    assert best.duration == pytest.approx(own, rel=5e-3)  # the profile knows nothing of the program


def test_the_line_stays_on_the_track_and_is_what_it_says(oval):
    track, best = oval
    at = best.path.at(np.linspace(0.0, best.path.length, 500))
    beside = deviations(track.path, {"p_x": at.x, "p_y": at.y}, near=0.0)
    assert track.clearance(beside["progress"], at.x, at.y).min() > 1.1 - 0.05
    np.testing.assert_allclose(
        np.interp(best.s[5:-5], beside["progress"], beside["lateral_deviation"]), best.aside[5:-5], atol=0.05
    )
    speed = speed_profile(best.path, LIMITS).speed_at(np.linspace(0.0, best.path.length, 500))
    np.testing.assert_allclose(np.interp(best.s[5:-5], beside["progress"], speed), best.speed[5:-5], rtol=0.03)


def test_a_mirrored_track_takes_as_long(oval):
    track, best = oval
    nodes = track.path.at(track.path.nodes[:-1])
    mirrored = Track(Path(np.column_stack([nodes.x, -nodes.y]), closed=True), WIDTH, WIDTH)
    np.testing.assert_allclose(track.limits(0.0), WIDTH)
    assert minimum_time(mirrored, LIMITS, 1.1, spacing=4.0).duration == pytest.approx(best.duration, rel=2e-3)


def test_more_room_and_more_grip_are_no_slower(oval):
    track, best = oval
    assert minimum_time(track, LIMITS, 0.5, spacing=4.0).duration < best.duration
    assert minimum_time(track, SpeedLimits.race(0.5), 1.1, spacing=4.0).duration > best.duration


def test_a_program_without_an_end_says_so():
    assert minimum_time(CIRCLE, LIMITS, MARGIN, spacing=8.0, max_iterations=1).outcome == "not found"


@pytest.fixture(scope="module")
def studied():
    study = RaceLineStudy(("oval",), spacing=8.0)
    return study, study.run()


def test_the_report_says_who_is_faster(studied):
    study, results = studied
    report = study.report(results)
    lines = report.summary["tracks"]["oval"]
    assert list(lines) == list(LINES)
    gain = 100.0 * (1.0 - lines["time"]["lap_time_s"] / lines["curvature"]["lap_time_s"])
    (said,) = finding(results["oval"])
    assert f"The line of least time takes {gain:.1f} % less than that of least curvature." in said
    assert [figure.key for figure in report.figures] == ["line-oval", "along-oval"]
    for figure in report.figures:
        draw(figure).draw_without_rendering()
        plot(figure)
    json.dumps(report.summary, allow_nan=False)
    lines["time"]["found"] = False
    assert lines_table(lines).rows[-1][-1] == "not found"


def test_what_tyres_leave_along_the_line_may_be_a_table():
    """Chords of an ellipse are within it, and those of a car's table close to it."""
    track, shares = TRACKS["oval"](), np.linspace(0.0, 1.0, 65)
    left = tuple(np.sqrt(1.0 - shares**2).tolist())
    table = replace(LIMITS, driving_left=left, braking_left=left)
    within, ellipse = (minimum_time(track, limits, 1.1, spacing=6.0).duration for limits in (table, LIMITS))
    assert ellipse * (1.0 - 1e-3) <= within <= 1.02 * ellipse
    car = SpeedLimits.of_car(PASSENGER_CAR, 0.9)
    best = minimum_time(track, car, 1.1, spacing=4.0)
    own, other = (speed_profile(line, car).duration for line in (best.path, minimum_curvature(track, 1.1)))
    assert best.duration == pytest.approx(own, rel=1e-2)
    assert own < other


@pytest.mark.slow
def test_a_lap_of_each_line_is_driven():
    study = RaceLineStudy(("oval",), spacing=4.0, drive=True)
    lines = study.summary(study.run())["tracks"]["oval"]
    laps = [lines[line]["driven_lap_time_s"] for line in ("time", "curvature", "centre")]
    assert laps == sorted(laps)
    for each in lines.values():
        assert each["driven_time_off_track_s"] == 0.0
        assert each["driven_lap_time_s"] == pytest.approx(each["lap_time_s"], rel=0.02)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: RaceLineStudy(()), r"tracks: got \(\), expected at least one track"),
        (lambda: RaceLineStudy(("iso-3888-1",)), "tracks: got .*, expected closed ones, for laps"),
        (lambda: RaceLineStudy(("ovl",)), "Did you mean 'oval'"),
        (lambda: RaceLineStudy(grip=0.0), "grip: got 0.0, expected a positive finite number"),
        (lambda: RaceLineStudy(margin=-1.0), "margin: got -1.0, expected a number of at least 0"),
        (lambda: minimum_time(CIRCLE, 8.0), "limits: got 8.0, expected a rumo.SpeedLimits"),
        (lambda: minimum_time(CIRCLE, LIMITS, 6.0), "margin: got 6 m, which leaves"),
        (lambda: minimum_time(CIRCLE, LIMITS, turning=0.0), "turning: got 0.0, expected a positive finite number"),
        (
            lambda: minimum_time(Track(Path([(0.0, 0.0), (90.0, 0.0)]), 5.0, 5.0), LIMITS),
            "track: got an open one, expected a closed one",
        ),
    ],
)
def test_mistakes(make, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        make()


def test_the_command_writes_all_it_promises(tmp_path):
    options = ("--tracks", "oval", "--spacing", "8", "--json", "--output", str(tmp_path))
    result = CliRunner().invoke(app, ["study", "race-line", *options])
    assert result.exit_code == 0, result.output
    figures = {f"{key}-oval.{ending}" for key in ("line", "along") for ending in ("png", "pdf")}
    assert {path.name for path in tmp_path.iterdir()} == {*figures, "summary.json", "report.html"}
    content = json.loads(result.stdout)
    assert (content["study"], content["spacing_m"]) == ("race-line", 8.0)
    assert content["tracks"]["oval"]["time"]["found"]
