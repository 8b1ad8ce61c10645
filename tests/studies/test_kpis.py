"""Figures of merit against closed forms: a car that drives around a circle, a car that brakes straight ahead."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

import rumo
from rumo.references import TRACKS, SpeedProfile, Track
from rumo.references import Path as Line
from rumo.simulation import Plant
from rumo.studies.kpis import KPIS, Driven, kpis
from rumo.studies.kpis.base import SUFFIXES, largest, percentile, rms
from rumo.vehicles import PASSENGER_CAR, four_wheel

RADIUS, SPEED, ASIDE, STEP = 50.0, 10.0, 0.4, 0.04
CIRCLE = Line.from_curvature((0.0, 2.0 * np.pi * RADIUS), (1.0 / RADIUS, 1.0 / RADIUS), closed=True)
"""To the left, from the origin along +x; its centre is (0, RADIUS)."""


def log_of(states, dt=STEP, **others):
    """A log with what figures of merit need: true states by name (K,), and whatever else is given."""
    count = len(next(iter(states.values())))
    inputs = others.pop("inputs", {"torque": np.zeros(count)})
    reach = others.pop("reach", 100.0)
    constraints = others.pop("constraints", {"grip": np.full(count, -1.0)})
    columns = ("time", "input")
    rows = np.column_stack([*inputs.values()])
    data = {
        "plant": (("time", "plant_state"), np.column_stack([*states.values()])),
        "applied": (columns, rows),
        "commanded": (columns, rows),
        "true_constraints": (("time", "constraint"), np.column_stack([*constraints.values()])),
        "reference": (("time", "output"), np.zeros((count, 1))),
        "disturbance": (("time", "parameter"), others.pop("parameters", np.zeros((count, 0)))),
        "status": ("time", others.pop("status", ["OPTIMAL"] * count)),
        "nis": ("time", np.full(count, np.nan)),
        "innovation_used": (("time", "measurement"), np.full((count, 1), np.nan)),
        **{name: ("time", np.full(count, 1e-3)) for name in ("step_time", "waited_time")},
        "rescued": ("time", np.zeros(count)),
    }
    coordinates = {
        "time": dt * np.arange(count),
        "plant_state": [*states],
        "input": [*inputs],
        "output": ["n"],
        "constraint": [*constraints],
        "input_lower": (columns, np.full(rows.shape, -reach)),
        "input_upper": (columns, np.full(rows.shape, reach)),
    }
    return xr.Dataset(data, coordinates, {"sampling_time_s": dt})


def around(count, aside=ASIDE, turned=0.0):
    """A car that drives around the circle, to the left of it, turned from its tangent."""
    angle = SPEED * STEP * np.arange(count) / RADIUS
    r = RADIUS - aside
    velocity = SPEED * r / RADIUS
    return {
        "p_x": r * np.sin(angle),
        "p_y": RADIUS - r * np.cos(angle),
        "psi": angle + turned,
        "v_x": np.full(count, velocity * np.cos(turned)),
        "v_y": np.full(count, -velocity * np.sin(turned)),
    }


def test_every_figure_says_what_it_is():
    for name, kpi in KPIS.items():
        assert name == kpi.name
        assert kpi.meaning.endswith(".")
        assert kpi.title
    assert len({kpi.key for kpi in KPIS.values()}) == len(KPIS)
    assert {kpi.unit for kpi in KPIS.values()} <= {*SUFFIXES, "m", "s", "rad", "us"}
    assert KPIS["lateral_deviation_rms"].key == "lateral_deviation_rms_m"
    assert KPIS["nis"].key == "nis"


def test_unknown_names_are_told():
    with pytest.raises(rumo.UnknownNameError, match="Did you mean 'lap_time'"):
        kpis(Driven(log_of(around(3))), ("laptime",))


def test_a_log_alone_leaves_out_what_takes_more():
    found = kpis(Driven(log_of(around(100))))
    for name in (
        "lap_time",
        "lateral_deviation_rms",
        "time_off_track",
        "friction_use_max",
        "tracking_error_rms",
        "nis",
    ):
        assert found[KPIS[name].key] is None, name
    assert found["lateral_acceleration_max_m_s2"] > 0.0


def test_around_a_circle():
    laps = 2.3
    count = round(laps * CIRCLE.length / SPEED / STEP)
    profile = SpeedProfile((0.0, CIRCLE.length), (SPEED, SPEED), closed=True)
    track = Track(CIRCLE, 2.0, 3.0)
    turned = 0.1
    drive = Driven(log_of(around(count, turned=turned)), track, profile=profile, car=PASSENGER_CAR)
    found = kpis(drive)
    lap = CIRCLE.length / SPEED
    assert drive.laps == pytest.approx([lap, lap], abs=1e-9)
    assert found["lap_time_s"] == pytest.approx(lap)
    assert found["profile_time_s"] == pytest.approx(lap)
    assert found["lap_time_over_profile_percent"] == pytest.approx(0.0, abs=1e-6)
    assert found["distance_m"] == pytest.approx(SPEED * STEP * (count - 1))
    for kind in ("rms", "p95", "max"):
        assert found[f"lateral_deviation_{kind}_m"] == pytest.approx(ASIDE, abs=1e-9)
        assert found[f"yaw_deviation_{kind}_rad"] == pytest.approx(turned, abs=1e-9)
    # Around a circle of radius r at speed v: v^2 / r, but for the chord of a sample.
    r = RADIUS - ASIDE
    velocity, half = SPEED * r / RADIUS, 0.5 * SPEED * STEP / RADIUS
    centripetal = velocity**2 / r * np.sin(half) / half
    along, across = drive.acceleration
    assert along == pytest.approx(np.full(count - 1, centripetal * np.sin(turned)), abs=1e-9)
    assert across == pytest.approx(np.full(count - 1, centripetal * np.cos(turned)), abs=1e-9)
    assert found["jerk_rms_m_s3"] == pytest.approx(0.0, abs=1e-6)
    assert found["speed_deviation_rms_m_s"] == pytest.approx(SPEED - velocity)


def test_the_room_to_the_edges_is_that_of_the_cars_outline():
    car = replace(PASSENGER_CAR, l_f=1.2, l_r=1.4, length=4.4, width=1.8)
    log = log_of(around(50, aside=0.0))
    forward, backward, half = 0.9 + 1.2, 0.9 + 1.4, 0.9  # the same overhang at both ends
    # Outside, the farthest is a rear corner; inside, the side is closest in its middle, here between two points.
    outer = np.hypot(RADIUS + half, max(forward, backward)) - RADIUS
    inner = RADIUS - np.hypot(RADIUS - half, 0.5 * (backward - forward))
    for left, right, least in ((9.0, 1.5, 1.5 - outer), (1.5, 9.0, 1.5 - inner)):
        room = Driven(log, Track(CIRCLE, left, right), car=car).room
        assert room == pytest.approx(np.full(50, least), abs=1e-9)
    narrow = kpis(Driven(log, Track(CIRCLE, 9.0, 0.9), car=car), ("time_off_track", "least_room"))
    assert narrow == {"time_off_track_s": pytest.approx(50 * STEP), "least_room_m": pytest.approx(0.9 - outer)}


def test_room_where_a_track_crosses_itself():
    """A car that follows another line than the track's own, from the crossing on, a little beside it."""
    track, car = TRACKS["eight"](), replace(PASSENGER_CAR, l_f=1.3, l_r=1.3, length=4.4, width=1.8)
    s = np.linspace(0.0, track.path.length, 200)[:-1]
    for first in (0, 99):  # both ways across
        places = track.path.offset(s, -0.3 * np.ones(len(s)))
        line = Line(places, closed=True)
        order = np.roll(np.arange(len(s)), -first)
        states = {"p_x": places[order, 0], "p_y": places[order, 1], "psi": track.path.at(s).heading[order]}
        room = Driven(log_of(states), track, line, car=car).room
        # 4 m to the edge, half the width and 0.3 m less, and what corners swing out by.
        assert 2.3 < room.min() <= room.max() < 4.0 - 0.9


def test_braking_straight_ahead_uses_the_friction_that_it_takes():
    """Together, the tyres' forces are mass times acceleration; wheels share them as the brakes share their torque."""
    car = replace(PASSENGER_CAR, b_lon=0.0, b_lat=0.0, brake_front=0.6, J=1e-3)
    plant = Plant(four_wheel(car, load_transfer=True), STEP)
    wheels = {f"w_{wheel}": 30.0 / car.r for wheel in ("fl", "fr", "rl", "rr")}
    x = plant.states.vector(dict.fromkeys(plant.states, 0.0) | {"v_x": 30.0} | wheels, "x")
    u, p = np.array([-0.5 * 5.0 * car.m * car.r, 0.0]), plant.default_parameters
    states = [x]
    for _ in range(10):
        states.append(plant.advance(states[-1], u, p))
    states = np.array(states)
    log = log_of(
        dict(zip(plant.states, states.T, strict=True)),
        inputs={"torque": np.full(11, u[0]), "steering_rate": np.zeros(11)},
        parameters=np.tile(p, (11, 1)),
    ).assign_coords(parameter=list(plant.parameters))
    drive = Driven(log, plant=plant)
    braking = -float(drive.acceleration[0][-1])
    assert braking == pytest.approx(5.0, rel=1e-3)
    transfer = 0.5 * car.m * car.h / car.wheelbase * braking
    for axle, load, share in (("f", car.front_load + transfer, 0.6), ("r", car.rear_load - transfer, 0.4)):
        mu = (car.front if axle == "f" else car.rear).mu
        expected = 0.5 * share * car.m * braking / (mu * load)
        for side in "lr":
            assert drive.friction_use[f"{axle}{side}"][-1] == pytest.approx(expected, rel=2e-3)
    found = kpis(drive, ("friction_use_max", "friction_use_p95"))
    assert set(found["friction_use_max"]) == {"fl", "fr", "rl", "rr"}


def test_a_plant_that_says_nothing_of_its_tyres_has_no_use_of_friction():
    log = log_of(around(3))
    assert Driven(log, plant=rumo.textbook.van_der_pol()).friction_use == {}


def test_inputs():
    torque = np.array([0.0, 10.0, 10.0, -10.0, 0.0, 1.0, 0.0])
    states = {"v_x": np.array([5.0, 5.0, 5.0, 1.0, 0.0, 0.0, 0.0]), "v_y": np.zeros(7)}
    found = kpis(Driven(log_of(states, dt=0.1, inputs={"torque": torque}, reach=50.0)))
    assert found["input_variation_per_s"] == {"torque": pytest.approx(42.0 / 0.6)}
    assert found["input_activity_per_s"] == {"torque": pytest.approx(42.0 / 0.6 / 100.0)}
    assert found["input_activity_at_rest_percent"] == {"torque": pytest.approx(1.0)}  # 1 of 100, twice
    assert found["bad_commands"] == 0
    moving = {"v_x": np.full(7, 5.0), "v_y": np.zeros(7)}
    log = log_of(moving, inputs={"torque": torque}, reach=np.inf)
    found = kpis(Driven(log))
    assert found["input_activity_at_rest_percent"] is None
    assert found["input_activity_per_s"] == {"torque": None}
    log["commanded"][2] = np.nan
    assert kpis(Driven(log))["bad_commands"] == 1


def test_constraints_and_steps():
    values = {"grip": np.array([-1.0, 0.5, 0.2, -0.1]), "unknown": np.full(4, np.nan)}
    status = ["OPTIMAL", "UNTRUSTED", "SOLVER_FAILED", "SKIPPED"]
    log = log_of({"v_x": np.ones(4)}, dt=0.1, constraints=values, status=status)
    log["step_time"][:] = [1e-3, 2e-3, 3e-3, np.nan]
    log["waited_time"][1] = 0.2
    log["nis"][1:] = [3.0, 5.0, np.nan]
    log["innovation_used"][:] = [[np.nan], [1.0], [1.0], [0.0]]
    found = kpis(Driven(log))
    assert found["constraint_violations"] == {"grip": 2}
    assert found["constraint_violation_max"] == {"grip": 0.5}
    assert found["constraint_violation_integral_s"] == {"grip": pytest.approx(0.07)}
    assert found["step_time_us"]["mean"] == pytest.approx(2000.0)
    assert found["step_time_us"]["max"] == pytest.approx(3000.0)
    assert found["step_time_us"]["p99.9"] == pytest.approx(np.percentile([1000.0, 2000.0, 3000.0], 99.9))
    assert found["deadline_misses"] == 1
    assert found["fallbacks"] == 1
    assert found["status_counts"] == dict.fromkeys(status, 1)
    assert (found["nis"], found["nis_expected"]) == (4.0, 1.0)


numbers = st.lists(st.floats(-1e6, 1e6).map(lambda x: round(x, 6)) | st.just(float("nan")), max_size=30)


@given(numbers)
def test_magnitudes_are_ordered(values):
    array = np.array(values, dtype=float)
    figures = rms(array), percentile(array, 95.0), largest(array)
    if np.isfinite(array).any():
        assert all(0.0 <= value <= figures[2] * (1.0 + 1e-12) for value in figures)
        assert largest(2.0 * array) == 2.0 * figures[2]
    else:
        assert figures == (None, None, None)


def test_the_page_has_the_table():
    page = (Path(__file__).parents[2] / "docs" / "logs.md").read_text(encoding="utf-8")
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in page.splitlines() if "|" in line]
    shown = rows[rows.index(["Key", "Unit", "Meaning"]) + 2 :]
    units = {"1": ""}
    assert shown == [[f"`{kpi.key}`", units.get(kpi.unit, kpi.unit), kpi.meaning] for kpi in KPIS.values()]
