"""What tyres may be asked for along the car: all of mu F_z, or less where a wheel would lock or spin before."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from rumo.vehicles import VEHICLES, ModifiedDugoff
from rumo.vehicles.traction import traction


@pytest.mark.parametrize("name", ["passenger", "commonroad-1", "commonroad-3", "paper"])
def test_ordinary_tyres_may_be_asked_for_all(name):
    car = VEHICLES[name]
    assert traction(car.front, car.front_load) == traction(car.rear, car.rear_load) == 1.0


@pytest.mark.parametrize("stiffness", [4.0, 8.0, 16.0])
def test_more_slip_gives_more_force_up_to_there(stiffness):
    load = 3000.0
    tyre = replace(VEHICLES["passenger"].front, C_s=stiffness * load, C_a=stiffness * load)
    asked = traction(tyre, load) * tyre.mu * load
    slips = np.linspace(0.0, 1.0, 4001)
    for sign in (1.0, -1.0):
        force = np.abs(ModifiedDugoff().force(tyre, ca.DM(sign * slips), 0.0, load, tyre.mu)[0].full().ravel())
        there = int(np.argmax(force >= asked))
        assert there > 0
        assert (np.diff(force[: there + 1]) > 0.0).all()
        assert force.max() >= 1.03 * asked
    assert traction(tyre, load) < traction(replace(tyre, C_s=2.0 * tyre.C_s, C_a=2.0 * tyre.C_a), load) <= 1.0
