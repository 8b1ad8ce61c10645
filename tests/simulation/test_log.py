"""Logs: units and dimensions of every variable, and the way through a file."""

import numpy as np
import pytest
import xarray as xr
from problems import pendulum

import rumo
from rumo.simulation import Constant, load, save
from rumo.simulation.faults import Missing
from rumo.simulation.log import names, signal
from rumo.studies import PaperStudy
from rumo.vehicles import PAPER_CAR, four_wheel

DIMENSIONS = {
    "plant": ("time", "plant_state"),
    "measured": ("time", "state"),
    "estimated": ("time", "state"),
    "applied": ("time", "input"),
    "commanded": ("time", "input"),
    "reference": ("time", "output"),
    "disturbance": ("time", "parameter"),
    "predicted_states": ("time", "stage", "state"),
    "predicted_inputs": ("time", "interval", "input"),
    "slacks": ("time", "interval", "constraint"),
    "status": ("time",),
    "cause": ("time",),
    "received": ("time", "state"),
    "measured_outputs": ("time", "measured_output"),
    "received_outputs": ("time", "measured_output"),
    "estimated_deviation": ("time", "state"),
    "true_states": ("time", "state"),
    "true_outputs": ("time", "output"),
    "estimated_outputs": ("time", "output"),
    "constraints": ("time", "interval", "constraint"),
    "true_constraints": ("time", "constraint"),
    "parameters": ("time", "interval", "model_parameter"),
    "prepare_time": ("time",),
    "feedback_time": ("time",),
    "step_time": ("time",),
}
SIGNALS = (
    "plant_state",
    "state",
    "input",
    "output",
    "parameter",
    "constraint",
    "measured_output",
    "model_parameter",
)


def car_log():
    return PaperStudy(controllers=("rti",), duration=0.2).run()["rti"]


def pendulum_log():
    """Without parameters in the plant, constraints or bounds: axes of length zero."""
    problem = pendulum(bounds=None)
    plant = rumo.Model(
        {"angle": "rad", "rate": "rad/s"}, {"torque": "N m"}, lambda x, u, p: {"angle": x.rate, "rate": u.torque}
    )
    return rumo.simulate(rumo.RealTimeIteration(problem), plant, [0.1, 0.0], {"angle": 0.0}, 0.2)


def failed_log():
    """Every measurement is lost: NaN all over, and a status that says so."""
    return rumo.simulate(
        rumo.RealTimeIteration(pendulum()),
        pendulum().model,
        [0.1, 0.0],
        {"angle": 0.0},
        0.2,
        faults=[Missing(when=range(10))],
        disturbances={"gravity": Constant(9.8)},
    )


every_log = pytest.mark.parametrize("make", [car_log, pendulum_log, failed_log])


@every_log
def test_dimensions_are_named(make):
    log = make()
    assert {name: variable.dims for name, variable in log.data_vars.items()} == DIMENSIONS


@every_log
def test_every_variable_with_signals_has_units(make):
    log = make()
    for name, dims in DIMENSIONS.items():
        variable = log[name]
        if dims[-1] in SIGNALS:
            units = {item.split(": ")[0]: item.split(": ")[1] for item in variable.attrs["units"].split(", ") if item}
            assert list(units) == names(log, dims[-1])
            assert list(units.values()) == log[f"{dims[-1]}_unit"].data.tolist()
            assert all(units.values())
        elif name.endswith("_time"):
            assert variable.attrs["units"] == "s"
        assert variable.attrs["long_name"]
    assert log["time"].attrs["units"] == "s"


def test_units_are_those_of_the_model():
    log, plant = car_log(), four_wheel(PAPER_CAR)
    assert names(log, "plant_state") == list(plant.states)
    assert log["plant_state_unit"].data.tolist() == list(plant.states.units)
    assert log["parameter_unit"].data.tolist() == ["m/s", "rad"]


def test_horizon_is_as_long_as_the_problems():
    log = car_log()
    assert log.sizes["stage"] == log.attrs["horizon"] + 1 == 16
    assert log.sizes["interval"] == 15
    assert log.sizes["time"] == 5


def test_input_bounds_are_in_the_log():
    log = car_log()
    assert log["input_lower"].data.tolist() == [[-300.0, -1.5]] * 5
    assert log["input_upper"].data.tolist() == [[300.0, 1.5]] * 5


def test_status_names_a_status():
    assert {rumo.Status[name] for name in car_log()["status"].data} <= set(rumo.Status)
    # No plan was ever made.
    assert failed_log()["status"].data.tolist() == ["PLAN_EXHAUSTED"] * 4


def test_step_time_is_the_sum_of_its_phases():
    log = car_log()
    np.testing.assert_allclose(log["step_time"], log["prepare_time"] + log["feedback_time"])


@every_log
def test_file_gives_the_log_back(make, tmp_path):
    log = make()
    path = save(log, tmp_path / "run.nc")
    xr.testing.assert_identical(load(path), log)


def test_file_keeps_numbers_to_the_last_bit(tmp_path):
    log = car_log()
    again = load(save(log, str(tmp_path / "run.nc")))
    for name, variable in log.variables.items():
        if variable.dtype.kind == "f":
            assert again[name].dtype == variable.dtype
            np.testing.assert_array_equal(again[name].data, variable.data)
    assert {key: type(value)(again.attrs[key]) for key, value in log.attrs.items()} == log.attrs


def test_saving_into_a_missing_folder_fails(tmp_path):
    with pytest.raises(OSError, match="missing"):
        save(pendulum_log(), tmp_path / "missing" / "run.nc")


def test_signal_picks_by_name():
    log = car_log()
    np.testing.assert_array_equal(signal(log, "plant", "v_x"), log["plant"].data[:, 3])
