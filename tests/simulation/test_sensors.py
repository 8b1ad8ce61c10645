"""Sensors: noise by state, and the plant seen with the controller's eyes."""

import numpy as np
import pytest

import rumo
from rumo.simulation import Sensors
from rumo.simulation.sensors import observation
from rumo.vehicles import PAPER_CAR, dynamic_bicycle, four_wheel


def test_states_without_noise_are_exact():
    np.testing.assert_array_equal(Sensors().deviations(four_wheel(PAPER_CAR)), np.zeros(11))


def test_noise_belongs_to_the_state_it_names():
    deviations = Sensors({"psi": 0.01, "p_x": 0.05}).deviations(four_wheel(PAPER_CAR))
    expected = np.zeros(11)
    expected[[0, 2]] = 0.05, 0.01
    np.testing.assert_array_equal(deviations, expected)


def test_noise_on_an_unknown_state_names_the_nearest():
    with pytest.raises(rumo.UnknownNameError, match=r"noise: got 'omga', .* Did you mean 'omega'\?"):
        Sensors({"omga": 0.01}).deviations(four_wheel(PAPER_CAR))


@pytest.mark.parametrize("value", [-0.1, np.nan, np.inf])
def test_impossible_deviation_is_refused(value):
    with pytest.raises(rumo.ArgumentError, match=r"noise\['psi'\]"):
        Sensors({"psi": value}).deviations(four_wheel(PAPER_CAR))


def test_plant_states_reach_the_controller_by_name():
    plant, model = four_wheel(PAPER_CAR), dynamic_bicycle(PAPER_CAR)
    x = np.arange(1.0, 12.0)
    seen = observation(plant, model)(x, np.zeros(2), np.zeros(2)).full().ravel()
    # Body states as they are, the means of each axle's wheels (7, 8) and (9, 10), the steering angle last.
    assert seen.tolist() == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.5, 9.5, 11.0]


def test_missing_plant_output_is_named():
    blind = rumo.Model(
        states={"angle": "rad"}, inputs={"torque": "N m"}, dynamics=lambda x, u, p: {"angle": u.torque}, name="blind"
    )
    model = rumo.Model(
        states={"angle": "rad", "rate": "rad/s"},
        inputs={"torque": "N m"},
        dynamics=lambda x, u, p: {"angle": x.rate, "rate": u.torque},
    )
    with pytest.raises(rumo.UnknownNameError, match=r"got 'rate', expected one of angle\. Give blind an output"):
        observation(blind, model)
