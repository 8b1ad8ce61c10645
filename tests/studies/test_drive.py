"""A car on a track: short drives, each end that a drive can come to, and what is said of it."""

import json
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import rumo
from rumo.references import TRACKS, Path, PathTracking, SpeedProfile, Track
from rumo.references.car_limits import accelerations
from rumo.report.charts import Panels
from rumo.report.figures import draw
from rumo.report.plots import plot
from rumo.simulation import Plant
from rumo.studies.base import carry_out
from rumo.studies.drive import ESTIMATORS, PLANTS, ROADS, Drive, DriveRun, DriveSetting, driven_car, driven_road
from rumo.studies.drive.run import _Watch
from rumo.studies.drive.start import first_motion
from rumo.vehicles import PASSENGER_CAR, VEHICLES, RearTorque, rolling_bicycle
from rumo.vehicles.parameters import GRAVITY

SHORT = Drive("oval", distance=60.0, backend="portable")


@pytest.fixture(scope="module")
def driven():
    return SHORT.run()


@pytest.fixture(scope="module")
def lost():
    study = Drive("oval", grip=5.0, estimator="none", backend="portable")
    return study, study.run()


def test_it_arrives_and_is_measured(driven):
    log = driven["rti"]
    content = SHORT.summary(driven)
    found = content["kpis"]
    assert content["outcome"] == "finished"
    assert re.fullmatch(r"Arrived after 6\d m and 1\.\d+ s\.", content["ended"])
    # Where the car is, as the loop itself has looked it up: its place beside the path is a state of the prediction.
    n, s = (log.true_states.sel(state=name).values for name in ("n", "s"))
    assert s[-1] >= 60.0 > s[-2]
    assert found["distance_m"] == pytest.approx(s.max(), abs=1e-6)
    assert found["lateral_deviation_rms_m"] == pytest.approx(np.sqrt(np.mean(n**2)), rel=1e-6)
    assert found["lateral_deviation_max_m"] == pytest.approx(np.abs(n).max(), rel=1e-6)
    yaw = log.true_states.sel(state="heading_error").values
    assert found["yaw_deviation_max_rad"] == pytest.approx(np.abs(yaw).max(), rel=1e-6)
    assert found["time_off_track_s"] == 0.0
    # On a straight, 10 m wide; the car turns by a degree or two at most.
    assert found["least_room_m"] == pytest.approx(5.0 - 0.5 * PASSENGER_CAR.width - np.abs(n).max(), abs=0.1)
    assert found["lap_time_s"] is None
    assert found["profile_time_s"] == SHORT.profile.duration
    assert set(found["friction_use_max"]) == {"fl", "fr", "rl", "rr"}
    assert sum(found["status_counts"].values()) == log.sizes["time"]
    assert found["nis_expected"] == 7.0
    json.dumps(content, allow_nan=False)


def test_the_report_has_all_figures(driven):
    report = SHORT.report(driven)
    assert report.warning == ""
    figures = {figure.key: figure for figure in report.figures}
    assert list(figures) == ["path", "g-g", "friction-use", "deviations", "inputs", "step-time"]
    for figure in figures.values():
        draw(figure).draw_without_rendering()
        if isinstance(figure, Panels):
            assert all("[" in title for title, _ in figure.panels) or "[" in figure.y_label
    path = figures["path"]
    log = driven["rti"]
    speed = np.hypot(*(log.plant.sel(plant_state=name).values for name in ("v_x", "v_y")))
    np.testing.assert_array_equal(path.colored.values, speed)
    printed, shown = draw(path).axes[0], plot(path)
    np.testing.assert_array_equal(printed.collections[0].get_array(), speed[:-1])
    np.testing.assert_array_equal(shown.data[0].marker.color, speed)
    assert plot(figures["step-time"]).data[1].x[0] == pytest.approx(1e3 * np.percentile(log.step_time, 99.0))
    rate = dict(figures["inputs"].panels)["Steering rate [rad/s]"]
    assert {abs(value) for line in rate[1:] for value in line.y[np.isfinite(line.y)]} <= {0.4}


def test_progress_is_told_in_metres():
    told = []
    dict(carry_out(SHORT.runs(), lambda *what: told.append(what)))
    names, done, every = zip(*told, strict=True)
    assert set(names) == {"rti (m)"}
    assert (done[-1], every[-1]) == (60, 60)
    assert sorted(done) == list(done)
    assert len(set(done)) > 20


def test_cars_that_are_lost_are_told_of(lost):
    study, results = lost
    log, report = results["rti"], study.report(results)
    assert report.summary["outcome"] == "lost"
    assert re.fullmatch(r"Lost at s = \d+ m, after [\d.]+ s: the car [^.]+(\.\d m beyond the edge)?\.", report.warning)
    assert log.attrs["ended"] == report.warning
    assert log.time.values[-1] < 0.5 * study.profile.duration
    assert report.summary["kpis"]["lap_time_s"] is None
    assert report.summary["kpis"]["time_off_track_s"] > 0.0
    assert report.summary["kpis"]["least_room_m"] < -5.0


def sample(time, **x):
    return SimpleNamespace(time=time, true={"p_x": 0.0, "p_y": 0.0, "psi": 0.0, "v_x": 10.0, "v_y": 0.0} | x)


def watch(distance=100.0, progress=None):
    path = Path.from_curvature((0.0, 200.0), (0.0, 0.0))
    profile = SpeedProfile((0.0, 200.0), (10.0, 10.0))
    scenario = SimpleNamespace(duration=50.0, problem=SimpleNamespace(sampling_time=0.04))
    return _Watch(DriveRun(scenario, Track(path, 3.0, 4.0), path, profile, 0.0, distance), progress)


@pytest.mark.parametrize(
    ("x", "words"),
    [
        ({"p_y": 13.5}, "the car is 10.5 m beyond the edge"),
        ({"p_y": -14.5}, "the car is 10.5 m beyond the edge"),
        ({"psi": 1.7}, "the car points 97 degrees away from its path"),
        ({"psi": -1.7 + 4.0 * np.pi}, "the car points 97 degrees away from its path"),
    ],
)
def test_what_a_lost_car_does(x, words):
    over = watch()
    assert not over(sample(0.0))
    assert over(sample(0.04, **x))
    assert (over.outcome, over.ended) == ("lost", f"Lost at s = 0 m, after 0.04 s: {words}.")


def test_a_car_that_stands_is_lost_one_that_is_slow_for_a_moment_is_not():
    over = watch()
    samples = [*[0.1] * 70, 5.0, *[0.1] * 80]
    ends = [over(sample(0.04 * k, v_x=speed)) for k, speed in enumerate(samples)]
    assert ends.index(True) in (70 + 75, 70 + 76)  # 3 s, as rounding has it
    assert over.ended.endswith("the car stands still.")


def test_a_car_arrives_when_it_has_driven_far_enough():
    told = []
    over = watch(progress=lambda *what: told.append(what))
    ends = [over(sample(0.5 * k, p_x=5.0 * k)) for k in range(21)]
    assert ends == [False] * 20 + [True]
    assert over.outcome == "finished"
    assert told[3] == (15, 100)
    assert told[-1] == (100, 100)
    assert watch().outcome == "late"  # unless something else is found


@pytest.mark.parametrize("mu", [None, 0.6])
def test_a_car_begins_in_the_motion_that_it_is_to_have(mu):
    """Held for 2 s, the first inputs keep it at its speed on a circle."""
    radius = 30.0
    circle = Path.from_curvature((0.0, 2.0 * np.pi * radius), (1.0 / radius, 1.0 / radius), closed=True)
    speed = np.sqrt(0.85 * (mu or PASSENGER_CAR.mu) * GRAVITY * radius)
    profile = SpeedProfile((0.0, circle.length), (speed, speed), closed=True)
    motion, inputs = first_motion(circle, profile, PASSENGER_CAR, RearTorque(), begin=20.0, mu=mu)
    plant = Plant(rolling_bicycle(PASSENGER_CAR), 2.0)
    p = plant.model.parameter_vector({} if mu is None else {"mu": mu})
    end = plant.advance(plant.states.vector(motion, "x"), plant.inputs.vector(inputs, "u"), p)
    end = dict(zip(plant.states, end, strict=True))
    assert np.hypot(end["p_x"], end["p_y"] - radius) == pytest.approx(radius, abs=1e-3)
    assert np.hypot(end["v_x"], end["v_y"]) == pytest.approx(speed, rel=1e-5)
    assert motion["v_y"] < speed * PASSENGER_CAR.l_r / radius - 0.3  # it does not roll without slip


def test_a_car_at_rest_begins_at_rest():
    straight = Path.from_curvature((0.0, 100.0), (0.0, 0.0))
    profile = SpeedProfile((0.0, 50.0, 100.0), (0.0, 10.0, 10.0))
    motion, inputs = first_motion(straight, profile, PASSENGER_CAR, RearTorque())
    assert not any(motion.values())
    assert not any(inputs.values())


@pytest.mark.parametrize("plant", PLANTS)
def test_every_plant_drives(plant):
    if plant.startswith("commonroad"):
        pytest.importorskip("vehiclemodels")
    study = replace(SHORT, plant=plant, distance=15.0, mu=0.8 if plant in ("four-wheel", "commonroad-std") else None)
    log = study.run()["rti"]
    content = study.summary({"rti": log})
    assert content["outcome"] == "finished"
    assert content["kpis"]["lateral_deviation_max_m"] < 0.3
    tyres = {"four-wheel": {"fl", "fr", "rl", "rr"}, "bicycle": {"f", "r"}}.get(plant)
    used = content["kpis"]["friction_use_max"]
    assert used is tyres or set(used) == tyres
    study.report({"rti": log})


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_every_estimator_estimates(estimator):
    study = replace(SHORT, estimator=estimator, distance=20.0)
    log = study.run()["rti"]
    assert log.attrs["outcome"] == "finished"
    error = np.abs(log.observed - log.true_observed).max()
    assert (error == 0.0) == (estimator == "none")
    assert (study.summary({"rti": log})["kpis"]["nis"] is None) == (estimator in ("none", "butterworth"))


@pytest.mark.parametrize("road", ROADS)
def test_every_road_can_be_begun(road):
    study = replace(SHORT, track=road, distance=15.0, grip=0.7)
    results = study.run()
    assert results["rti"].attrs["outcome"] == "finished"
    figures = {figure.key: figure for figure in study.report(results).figures}
    assert ("Cones" in [line.name for line in figures["path"].lines]) == road.startswith("iso")


def test_own_files_drive_as_names_do(tmp_path, driven):
    oval = TRACKS["oval"]()
    s = np.arange(0.0, oval.path.length, 2.0)
    points = oval.path.at(s)
    rows = np.column_stack([points.x, points.y, np.full((len(s), 2), 5.0)])
    np.savetxt(tmp_path / "mine.csv", rows, delimiter=",", header="x_m,y_m,w_tr_right_m,w_tr_left_m")
    PASSENGER_CAR.to_toml(tmp_path / "car.toml")
    study = replace(SHORT, track=tmp_path / "mine.csv", vehicle=tmp_path / "car.toml")
    assert study.car == PASSENGER_CAR
    assert study.road.path.length == pytest.approx(oval.path.length, rel=1e-4)
    content = study.summary(study.run())
    assert (content["track"], content["vehicle"], content["outcome"]) == ("mine", "car", "finished")
    there = SHORT.summary(driven)["kpis"]
    assert content["kpis"]["lateral_deviation_rms_m"] == pytest.approx(there["lateral_deviation_rms_m"], rel=0.05)


def test_friction_is_known_to_plant_controller_and_profile():
    study = replace(SHORT, mu=0.4, distance=10.0)
    log = study.run()["rti"]
    assert set(log.disturbance.sel(parameter="mu").values) == {0.4}
    assert set(log.parameters.sel(model_parameter="mu").values.ravel()) == {0.4}
    # In the bends of 40 m, all of the grip is for turning and for what turning and the drag of the air take.
    speed = study.profile.v.min()
    left = accelerations(study.car, 0.9, 0.4)
    driving, resistance = (np.interp(speed**2 / 40.0, left.lateral, of) for of in (left.driving, left.resistance))
    assert 0.98 < speed / np.sqrt(0.9 * 0.4 * GRAVITY * 40.0) < 1.0
    assert driving == pytest.approx(resistance + study.car.b_lon / study.car.m * speed**2, abs=0.01)


def test_a_plant_may_name_its_car():
    pytest.importorskip("vehiclemodels")
    assert Drive(plant="commonroad-std:3").car == replace(VEHICLES["commonroad-3"], b_lon=0.0, b_lat=0.0)
    assert Drive(plant="commonroad-std", vehicle="commonroad-1").driven_car.plant.name == "CommonRoad std, vehicle 1"
    assert driven_car("commonroad-std", VEHICLES["commonroad-1"], 0.04).plant.name.endswith("vehicle 1")


def test_drives_of_other_problems_and_references():
    """What later studies need: a problem by position, with its own model observed, from a place of choice."""
    road = driven_road("oval", PASSENGER_CAR)
    profile = SpeedProfile((0.0, road.path.length), (15.0, 15.0), closed=True)
    problem = rumo.Problem(
        rolling_bicycle(PASSENGER_CAR),
        horizon=20,
        sampling_time=0.04,
        track={"p_x": rumo.Weight(10.0, 6.0), "p_y": rumo.Weight(10.0, 6.0), "speed": rumo.Weight(1.0, 10.0)},
        moves={"torque": rumo.Weight(1.0, 5000.0), "steering_rate": rumo.Weight(0.3, 1.6)},
        bounds={"torque": (-1000.0, 1000.0), "steering_rate": (-0.4, 0.4)},
        delay=1,
    )
    setting = DriveSetting(
        road.path,
        profile,
        driven_car("four-wheel", PASSENGER_CAR, 0.04),
        10.0,
        problem=problem,
        reference=PathTracking(road.path, profile, vehicle=PASSENGER_CAR, begin=50.0),
        backend="portable",
        begin=50.0,
    )
    log = DriveRun(setting.scenario(), road.track, road.path, profile, 50.0, 40.0).run()
    assert log.attrs["outcome"] == "finished"
    assert log.time.values[-1] == pytest.approx(40.0 / 15.0, rel=0.1)
    np.testing.assert_allclose(log.plant.sel(plant_state="p_y"), road.path.at(50.0).y, atol=0.1)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"track": "ovl"}, "track: got 'ovl', expected one of oval, .* Did you mean 'oval'?"),
        ({"track": "nosuch.csv"}, "track: got 'nosuch.csv', which is not there, expected a file, or one of oval,"),
        ({"track": "."}, "track: got '.', which is a folder"),
        ({"vehicle": "pasenger"}, "vehicle: got 'pasenger', .* Did you mean 'passenger'?"),
        ({"vehicle": "nosuch.toml"}, "vehicle: got 'nosuch.toml' .No such file"),
        ({"plant": "four_wheel"}, "plant: got 'four_wheel', .* Did you mean 'four-wheel'?"),
        ({"plant": "bicycle:2"}, "plant: got 'bicycle:2', expected bicycle, whose car is the vehicle."),
        ({"plant": "commonroad-mb:7"}, "plant: got 'commonroad-mb:7', expected commonroad-mb:1, "),
        ({"plant": "commonroad-mb", "vehicle": "racer"}, "a vehicle that is none of CommonRoad's"),
        ({"controller": "rtii"}, "controller: got 'rtii', .* Did you mean 'rti'?"),
        ({"estimator": "kf"}, "estimator: got 'kf', expected one of ekf, mhe, butterworth, none."),
        ({"grip": -0.9}, "grip: got -0.9, expected a positive finite number."),
        ({"laps": 0}, "laps: got 0, expected a whole number of at least 1."),
        ({"track": "iso-3888-2", "laps": 2}, "laps: got 2, expected 1: ISO 3888-2 leads from one end to the other."),
        ({"mu": 0.0}, "mu: got 0.0"),
        ({"distance": np.nan}, "distance: got nan"),
        ({"seed": -1}, "seed: got -1"),
        ({"width": 8.0}, "width: got 8.0, expected nothing: oval is no file."),
    ],
)
def test_misuse(settings, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        replace(SHORT, **settings)


def test_bad_files_are_told_with_their_line(tmp_path):
    track, car = tmp_path / "bad.csv", tmp_path / "bad.toml"
    track.write_text("x,y\n0,0\n10,nan\n20,5\n")
    with pytest.raises(rumo.FileError, match=r"bad\.csv, line 3"):
        Drive(track)
    track.write_text("x,y\n0,0\n10,1\n20,5\n30,20\n")
    with pytest.raises(rumo.FileError, match="Say how wide the track is"):
        Drive(track)
    assert Drive(track, width=8.0).road.track.limits(0.0)[0] == pytest.approx(4.0, abs=0.1)
    car.write_text("m = 1000\nmass = 2")
    with pytest.raises(rumo.ArgumentError, match=r"bad\.toml: mass"):
        Drive(vehicle=car)


def test_plants_without_friction_cannot_be_given_any():
    pytest.importorskip("vehiclemodels")
    with pytest.raises(rumo.ArgumentError, match="this plant has no friction"):
        replace(SHORT, plant="commonroad-st", mu=0.5).runs()
