"""A single measurement that is finite but wild does not lose the car."""

from dataclasses import replace

import numpy as np
import pytest

from rumo.simulation.faults import Reading
from rumo.studies import PaperStudy

WILD = 50


READINGS = [
    ("psi", 0.6),
    ("psi", 1.0),
    ("psi", 2.0 * np.pi),
    ("p_y", 100.0),
    ("p_y", 1e6),
    ("v_x", -50.0),
    ("omega", 1e3),
]
WILDEST = [("psi", 2.0 * np.pi), ("p_y", 1e6), ("omega", 1e3)]


@pytest.mark.parametrize(
    ("controller", "name", "value"),
    [
        pytest.param(controller, *reading, marks=() if controller == "rti" or reading in WILDEST else pytest.mark.slow)
        for controller in ("rti", "ltv")
        for reading in READINGS
    ],
)
def test_the_car_is_back_on_its_path(controller, name, value):
    study = PaperStudy(duration=6.0, noise={}, estimator=None)
    scenario = study.scenario(controller, study.problem(), study.plant())
    log = replace(scenario, faults=(Reading(range(WILD, WILD + 1), name, value),)).run()
    # Two samples of full torque may be felt; what stays is an error along the path, which the paper's weights leave.
    speed = log.plant.sel(plant_state="v_x").values
    assert speed[-1] == pytest.approx(8.0, abs=0.5)
    heading = log.plant.sel(plant_state="psi").values - log.reference.sel(output="psi").values
    assert abs(heading[-1]) < 0.1
    path_y = 3.0 * np.sin(2.0 * np.pi * log.plant.sel(plant_state="p_x").values / 60.0)
    lateral = log.plant.sel(plant_state="p_y").values - path_y
    assert np.abs(lateral[WILD + 50 :]).max() < 1.0
    assert set(log.status.values[WILD + 25 :]) == {"OPTIMAL"}
