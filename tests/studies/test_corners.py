"""Corners at the limit of grip: what the NLP holds the safeguarded iteration holds, and the gate holds back nothing."""

import os
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import splev, splprep

from rumo.references import Road, speeds_within
from rumo.simulation.log import signal
from rumo.status import Status
from rumo.studies.linearization import CORNER, SWEEPS, LinearizationStudy
from rumo.studies.linearization.corners import CHICANE, HAIRPIN, ICE, RIGHT_ANGLE, curvature_of
from rumo.studies.linearization.study import KINDS
from rumo.studies.linearization.summary import outcome
from rumo.studies.paper.study import NOISE
from rumo.studies.sharing import shared_controller
from rumo.vehicles.parameters import GRAVITY

TRACKS = os.environ.get("RUMO_TRACKS")
"""Folder of centre lines of race tracks, as in the TUM's database: `# x_m,y_m,w_tr_right_m,w_tr_left_m`."""


@lru_cache
def parts_of(sweep):
    """Problem and plant, once for all drives of a sweep: so is the controller then."""
    base = SWEEPS[sweep].base
    return base.problem(), base.plant()


def drive_of(sweep, value, **changes):
    return replace(SWEEPS[sweep].drive(SWEEPS[sweep].base, value), **changes)


@pytest.mark.parametrize(("bends", "turn"), [(HAIRPIN, np.pi), (CHICANE, 0.0), (RIGHT_ANGLE, -0.5 * np.pi)])
def test_bends_turn_by_their_angles_at_their_radius(bends, turn):
    stations, curvature = curvature_of(bends, 30.0)
    reference = Road(stations, curvature, 1.0)(np.array([0.0, stations[-1]]))
    assert np.ptp(reference["psi"]) * np.sign(turn) == pytest.approx(turn, abs=1e-9)
    assert np.abs(curvature).max() == pytest.approx(1.0 / bends[0][0])
    assert curvature[:2] == [0.0, 0.0]


@pytest.mark.parametrize("sweep", ["hairpin", "chicane", "right_angle", "cold_start"])
@pytest.mark.parametrize("share", [0.5, 1.1])
def test_roads_need_the_grip_that_they_say(sweep, share):
    drive = drive_of(sweep, share)
    reference = drive.road(np.linspace(0.0, 12.0, 12001))
    most = np.abs(reference["v_x"] * reference["omega"]).max()
    assert most == pytest.approx(share * drive.car.front.mu * GRAVITY, rel=2e-3)


def test_cars_start_where_the_sweep_says():
    on_the_road, beside = (drive_of("bend_error", error) for error in (0.0, 3.0))
    begin = on_the_road.road(np.zeros(1))
    x, moved = on_the_road.initial_state(), beside.initial_state()
    assert begin["omega"] * 20.0 == pytest.approx(begin["v_x"])  # a radius of 20 m
    assert {name: x[name] for name in ("psi", "v_x", "omega", "delta")} == {
        name: float(begin[name][0]) for name in ("psi", "v_x", "omega", "delta")
    }
    across = np.array([-np.sin(x["psi"]), np.cos(x["psi"])])
    np.testing.assert_allclose([moved["p_x"] - x["p_x"], moved["p_y"] - x["p_y"]], 3.0 * across)


def test_ice_comes_in_the_bend_and_goes():
    drive = drive_of("ice", 0.4)
    (fault,) = drive.scenario("rti", *parts_of("ice")).faults
    begin, end = fault.when
    assert end - begin == pytest.approx(0.4)
    assert drive.road(np.array([begin]))["omega"] * 20.0 == pytest.approx(drive.road(np.zeros(1))["v_x"])
    assert not drive_of("ice", 0.0).scenario("rti", *parts_of("ice")).faults
    assert ICE == 0.3


HARD = [("right_angle", 0.85), ("bend_error", -4.0), ("bend_error", 8.0), ("ice", 1.0)]


@pytest.mark.parametrize(
    ("sweep", "value"), [HARD[0], *(pytest.param(*case, marks=pytest.mark.slow) for case in HARD[1:])]
)
def test_it_drives_where_full_steps_lose_the_car_or_cost_many_times_as_much(sweep, value):
    study = LinearizationStudy(("rti", "plain", "nlp"), {sweep: (value,)}, duration=6.0)
    controllers = study.summary(study.run())["sweeps"][sweep]["controllers"]
    rti, plain, nlp = (controllers[name][0] for name in ("rti", "plain", "nlp"))
    assert (rti["lost"], nlp["lost"]) == (False, False)
    assert rti["cost_over_nlp"] <= 1.05
    assert plain["lost"] or plain["cost_over_nlp"] > 2.0


@pytest.mark.parametrize(
    ("sweep", "share"),
    [
        pytest.param(sweep, share, marks=() if (sweep, share) == ("hairpin", 1.1) else pytest.mark.slow)
        for sweep in ("hairpin", "chicane", "right_angle")
        for share in (0.85, 1.1)
    ],
)
def test_corners_are_driven_as_by_the_nlp(sweep, share):
    compare(drive_of(sweep, share, duration=6.0), *parts_of(sweep))


def compare(drive, problem, plant):
    """What the NLP holds, the real-time iteration holds, and pays at most 5 % more."""
    runs = {}
    for name in ("rti", "nlp"):
        options = {"gate": None} | ({"max_iterations": 1000} if name == "nlp" else {})
        scenario = replace(drive.scenario(KINDS[name], problem, plant), settings=options)
        runs[name] = outcome(scenario.run(shared_controller(scenario)), problem, scenario.samples)
    assert not runs["rti"]["lost"] or runs["nlp"]["lost"]
    assert runs["nlp"]["lost"] or runs["rti"]["cost"] <= 1.05 * runs["nlp"]["cost"]


@pytest.mark.parametrize("noise", [{}, NOISE], ids=["exact", "noisy"])
@pytest.mark.parametrize(("sweep", "value"), [*HARD, ("hairpin", 1.1), ("cold_start", 1.1), ("ice", 1.2)])
def test_the_gate_holds_back_nothing_at_the_limit(sweep, value, noise):
    drive = drive_of(sweep, value, duration=6.0, noise=noise)
    scenario = drive.scenario("rti", *parts_of(sweep))
    log = scenario.run(shared_controller(scenario))
    assert "held" not in log["symptom"].values
    assert Status.BAD_MEASUREMENT.name not in log["status"].values
    if sweep == "ice":  # a skid: 5 degrees of sideslip are more than twice what a bend of 20 m takes
        assert np.abs(np.arctan2(signal(log, "plant", "v_y"), signal(log, "plant", "v_x"))).max() > np.deg2rad(5.0)


def corner_of(name, rank):
    """Stations [m] and curvature [1/m] from 60 m before a track's sharpest corner, or another, to 100 m behind."""
    points = np.loadtxt(Path(TRACKS) / f"{name}.csv", delimiter=",", comments="#")[:, :2]
    line, _ = splprep(np.vstack([points, points[:1]]).T, s=0.05 * len(points), per=True)
    at = np.linspace(0.0, 1.0, 20001)
    (dx, dy), (ddx, ddy) = splev(at, line, 1), splev(at, line, 2)
    speed = np.hypot(dx, dy)
    lengths = np.r_[0.0, np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(at))]
    s = np.arange(0.0, lengths[-1], 2.0)
    kappa = np.interp(s, lengths, (dx * ddy - dy * ddx) / speed**3)
    corners = []
    for sharpest in s[np.argsort(-np.abs(kappa))]:
        away = [abs(sharpest - other) for other in corners]
        if all(80.0 < gap < lengths[-1] - 80.0 for gap in away):
            corners.append(sharpest)
    here = np.arange(corners[rank] - 60.0, corners[rank] + 100.0, 0.5)
    return here - here[0], np.interp(here % lengths[-1], s, kappa)


@pytest.mark.skipif(not TRACKS, reason="needs centre lines of race tracks in the folder RUMO_TRACKS")
@pytest.mark.slow
@pytest.mark.parametrize("share", [0.9, 1.05])
@pytest.mark.parametrize(("name", "rank"), [("BrandsHatch", 0), ("Norisring", 0), ("Norisring", 2), ("Zandvoort", 1)])
def test_race_tracks_are_driven_as_by_the_nlp(name, rank, share, monkeypatch):
    s, kappa = corner_of(name, rank)
    limit = share * CORNER.car.front.mu * GRAVITY
    v = speeds_within(s, kappa, lateral=limit, braking=3.0, driving=2.0, top=40.0)
    road = Road(s, kappa, v, CORNER.car)
    monkeypatch.setattr(type(CORNER), "road", property(lambda _: road))
    compare(replace(CORNER, duration=5.0), *parts_of("hairpin"))
