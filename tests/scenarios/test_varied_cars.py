"""One model for cars that differ in numbers: it is each of them, and refuses what is none."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rumo
from rumo.simulation import Constant, Plant
from rumo.studies import PaperStudy
from rumo.vehicles import PAPER_CAR, PASSENGER_CAR, four_wheel
from rumo.vehicles.varied import OF_ALL_CARS, VARIABLES

MODEL = four_wheel(PASSENGER_CAR, load_transfer=True, varied=tuple(VARIABLES))
OUTPUTS = ("friction_use_fl", "friction_use_rr")


def with_numbers(car, values):
    """A car as its class makes it."""
    own, tyres = {}, {}
    for name, value in values.items():
        axle, _, inner = VARIABLES[name].path.rpartition(".")
        (tyres.setdefault(axle, {}) if axle else own)[inner] = value
    return replace(car, **own, **{axle: replace(getattr(car, axle), **numbers) for axle, numbers in tyres.items()})


@settings(max_examples=10, deadline=None)
@given(st.data())
def test_it_is_the_model_of_each_car(data):
    share = st.floats(0.0, 1.0)
    values = {
        name: data.draw(share) if each.limits[1] == 1.0 else each.of(PASSENGER_CAR) * data.draw(st.floats(0.5, 2.0))
        for name, each in VARIABLES.items()
    }
    model = four_wheel(with_numbers(PASSENGER_CAR, values), load_transfer=True)
    rng = np.random.default_rng(data.draw(st.integers(0, 1000)))
    x = rng.normal(size=len(model.states)) + np.array([0, 0, 0, 15.0, 0, 0, 40.0, 40.0, 40.0, 40.0, 0])
    u = 100.0 * rng.normal(size=2)
    road = {"wind_speed": 3.0, "wind_direction": 1.0, "mu": 0.8}
    expected = np.array(model.f(x, u, model.parameter_vector(road))).ravel()
    found = np.array(MODEL.f(x, u, MODEL.parameter_vector(road | values))).ravel()
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-9)


def test_outputs_are_of_the_same_car():
    heavy = four_wheel(replace(PAPER_CAR, m=300.0))
    varied = four_wheel(PAPER_CAR, varied=["m"])
    x, u = np.array([0, 0, 0, 8.0, 0.1, 0.2, 13.0, 13.1, 13.2, 13.3, 0.1]), np.array([50.0, 0.1])
    observed = [
        Plant(model, 0.04).observer(OUTPUTS)(x, u, model.parameter_vector(values))
        for model, values in ((heavy, {}), (varied, {"m": 300.0}))
    ]
    np.testing.assert_allclose(*observed, rtol=1e-12)


def test_nothing_varied_is_the_same_model():
    plain, other = four_wheel(PAPER_CAR), four_wheel(PAPER_CAR, varied=())
    assert str(plain.f) == str(other.f)
    assert plain.f.serialize() == other.f.serialize()


def test_parameters_have_units_and_the_cars_own_values():
    model = four_wheel(PAPER_CAR, varied=OF_ALL_CARS)
    assert model.parameters.names == ("wind_speed", "wind_direction", "mu", *OF_ALL_CARS)
    assert model.parameters.unit("front_C_a") == "N/rad"
    assert model.parameter_items["m"].default == 200.0


@pytest.mark.parametrize(
    ("varied", "said"),
    [
        (("mass",), "varied: got 'mass'"),
        ("m", r"Write \('m',\)"),
        (("brake_front",), "brake_front = None"),
    ],
)
def test_what_a_car_does_not_have_cannot_vary(varied, said):
    with pytest.raises(rumo.ArgumentError, match=said):
        four_wheel(PAPER_CAR, varied=varied)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("m", 0.0, r"disturbances\['m'\]: got 0.0, expected a positive number"),
        ("b_lon", -1.0, "a number of at least 0"),
        ("mu", -0.1, "a number of at least 0"),
    ],
)
def test_a_car_that_cannot_be_is_an_error_before_the_run(name, value, said):
    study = PaperStudy()
    plant = Plant(four_wheel(PAPER_CAR, varied=OF_ALL_CARS), study.sampling_time)
    scenario = study.scenario("rti", study.problem(), plant)
    with pytest.raises(rumo.ArgumentError, match=said):
        replace(scenario, disturbances={name: Constant(value)})


def test_limits_of_parameters_hold_for_their_defaults():
    with pytest.raises(rumo.ArgumentError, match=r"parameters\['share'\]\.default: got 2.0, expected a number from 0"):
        rumo.Model(
            {"x": "m"},
            {"u": "m/s"},
            lambda x, u, p: {"x": u.u},
            parameters={"share": rumo.Parameter("1", 2.0, 0.0, 1.0)},
        )
