"""How fast a plant turns before it is at its end."""

from dataclasses import replace

import numpy as np
import pytest

import rumo
from rumo.simulation.plants.commonroad.car import LATERAL
from rumo.studies.drive import driven_car, steady_bend
from rumo.studies.drive.steady_bend import ENDLESS, FALLING, LIFTED
from rumo.vehicles import PASSENGER_CAR, ModifiedDugoff
from rumo.vehicles.parameters import GRAVITY

CAR = PASSENGER_CAR


def test_without_load_transfer_it_is_the_peak_of_the_tyres():
    flat = replace(CAR, h=0.0, b_lon=0.0, b_lat=0.0)
    slips = np.linspace(0.0, 0.4, 400)
    peak = max(ModifiedDugoff().force(CAR.front, 0.0, slip, CAR.front_load, CAR.mu)[1] for slip in slips)
    found = steady_bend(driven_car("four-wheel", flat, 0.04), 15.0)
    # Less than its peak along the path, by the slip angle; rear tyres also drive.
    assert 0.94 < found.lateral * CAR.front_load / (GRAVITY * peak) < 1.0
    assert steady_bend(driven_car("four-wheel", flat, 0.04), 15.0, left=False).lateral == pytest.approx(found.lateral)


def test_a_profile_keeps_within_it():
    """Of the passenger car, whose inner wheels carry less and drive."""
    found = steady_bend(driven_car("four-wheel", CAR, 0.04), 15.0)
    assert found.ended == FALLING
    path = rumo.references.generators.circle(15.0**2 / found.lateral)
    profile = rumo.references.speed_profile(path, rumo.references.SpeedLimits.of_car(CAR, 0.9))
    assert 14.0 < profile.v.max() < 15.0


@pytest.mark.parametrize(("vehicle", "speed"), [(1, 12.0), (2, 40.0), (3, 40.0)])
def test_limits_of_multi_body_cars_are_where_wheels_lift(vehicle, speed):
    pytest.importorskip("vehiclemodels")
    driven = driven_car(f"commonroad-mb:{vehicle}", CAR, 0.04)
    found = steady_bend(driven, speed, left=False)
    assert found.ended == LIFTED
    assert driven.car.limits.lateral == LATERAL["mb"][vehicle] == pytest.approx(found.lateral - 0.05, abs=0.05)


def test_grip_may_have_no_end():
    pytest.importorskip("vehiclemodels")
    assert steady_bend(driven_car("commonroad-ks:2", CAR, 0.04), 15.0).ended == ENDLESS


def test_arguments_are_checked():
    driven = driven_car("four-wheel", CAR, 0.04)
    with pytest.raises(rumo.ArgumentError, match="speed: got 0"):
        steady_bend(driven, 0.0)
    with pytest.raises(rumo.ArgumentError, match=r"speed: got 4 m/s, at which steering gives .* expected at least"):
        steady_bend(driven, 4.0)
    with pytest.raises(rumo.ArgumentError, match="driven: got 'four-wheel'"):
        steady_bend("four-wheel", 20.0)
