"""Logs: units and dimensions of every variable, and the way through a file."""

import logging
import os
import random

import h5py
import numpy as np
import pytest
import xarray as xr
from problems import pendulum

import rumo
from rumo.simulation import Constant, load, save
from rumo.simulation.faults import Missing
from rumo.simulation.log import SEAL, SEALED, names, signal
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
    "rescued": ("time",),
    "health": ("time", "state"),
    "symptom": ("time", "state"),
    "received": ("time", "state"),
    "measured_outputs": ("time", "measured_output"),
    "received_outputs": ("time", "measured_output"),
    "estimated_deviation": ("time", "state"),
    "estimated_parameters": ("time", "model_parameter"),
    "estimated_biases": ("time", "measurement"),
    "innovation": ("time", "measurement"),
    "innovation_deviation": ("time", "measurement"),
    "innovation_used": ("time", "measurement"),
    "nis": ("time",),
    "true_states": ("time", "state"),
    "true_outputs": ("time", "output"),
    "estimated_outputs": ("time", "output"),
    "constraints": ("time", "interval", "constraint"),
    "true_constraints": ("time", "constraint"),
    "parameters": ("time", "interval", "model_parameter"),
    "prepare_time": ("time",),
    "feedback_time": ("time",),
    "step_time": ("time",),
    "waited_time": ("time",),
}
SIGNALS = (
    "plant_state",
    "state",
    "input",
    "output",
    "parameter",
    "constraint",
    "measurement",
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
        if name in ("health", "innovation_used", "nis"):
            assert variable.attrs["units"] == "1"
        elif name == "symptom":
            assert "units" not in variable.attrs
        elif dims[-1] in SIGNALS:
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
    assert log["parameter_unit"].data.tolist() == ["m/s", "rad", "1"]


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
    np.testing.assert_allclose(log["waited_time"], log["step_time"])  # the loop calls for both at once


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


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """A log, and its file's bytes."""
    log = car_log()
    return log, save(log, tmp_path_factory.mktemp("log") / "run.nc").read_bytes()


def test_a_flipped_bit_is_told(kept, tmp_path):
    _, whole = kept
    draw, path = random.Random(0), tmp_path / "run.nc"
    for place in draw.sample(range(8 * (len(whole) - SEALED)), 60):
        spoiled = bytearray(whole)
        spoiled[place // 8] ^= 1 << place % 8
        path.write_bytes(spoiled)
        with pytest.raises(rumo.ArgumentError, match=r"run\.nc.*checksum.*expected a log as `save` writes it"):
            load(path)


@pytest.mark.parametrize("place", [0, len(SEAL) - 1])
def test_without_its_mark_a_checksum_is_none(place, kept, tmp_path, caplog):
    log, whole = kept
    spoiled = bytearray(whole)
    spoiled[place - SEALED] ^= 1
    path = tmp_path / "run.nc"
    path.write_bytes(spoiled)
    xr.testing.assert_identical(load(path), log)
    assert "has no checksum" in caplog.text


@pytest.mark.parametrize("place", [-65, -30, -2, -1])
def test_a_spoiled_checksum_is_told(place, kept, tmp_path):
    spoiled, path = bytearray(kept[1]), tmp_path / "run.nc"
    spoiled[place] ^= 1
    path.write_bytes(spoiled)
    with pytest.raises(rumo.ArgumentError, match="checksum"):
        load(path)


def test_a_truncated_file_is_told(kept, tmp_path):
    _, whole = kept
    draw, path = random.Random(0), tmp_path / "run.nc"
    for length in (0, 1, 8, *draw.sample(range(len(whole) - SEALED), 40), len(whole) - SEALED - 1):
        path.write_bytes(whole[:length])
        with pytest.raises(rumo.ArgumentError, match=r"run\.nc.*cannot be read"):
            load(path)


def test_without_a_checksum_there_is_a_warning(kept, tmp_path, caplog):
    log, _ = kept
    path = tmp_path / "run.nc"
    log.to_netcdf(path, engine="h5netcdf")
    with caplog.at_level(logging.WARNING, "rumo"):
        xr.testing.assert_identical(load(path), log)
        (record,) = caplog.records
        assert "run.nc has no checksum" in record.getMessage()
        load(save(load(path), path))
    assert len(caplog.records) == 2


@pytest.mark.parametrize("content", [b"", b"%PDF-1.7", b"\x89HDF\r\n\x1a\n", bytes(10_000), b"CDF\x01" + bytes(60)])
def test_another_kind_of_file_is_told(content, tmp_path):
    path = tmp_path / "run.nc"
    path.write_bytes(content)
    with pytest.raises(rumo.ArgumentError, match="cannot be read"):
        load(path)


@pytest.mark.skipif(os.name != "posix", reason="no pipes in folders")
def test_what_is_no_file_is_told(tmp_path):
    with pytest.raises(FileNotFoundError):
        load(tmp_path / "missing.nc")
    with pytest.raises(IsADirectoryError):
        load(tmp_path)
    with pytest.raises(rumo.ArgumentError, match="which is no file"):
        load("/dev/zero")
    for use in (load, lambda path: save(car_log(), path)):
        with pytest.raises(rumo.ArgumentError, match="path"):
            use("run\0.nc")


def test_a_file_that_claims_too_much_is_told(kept, tmp_path):
    log, _ = kept
    path = tmp_path / "run.nc"
    log.to_netcdf(path, engine="h5netcdf")
    with h5py.File(path, "a") as file:
        file.create_dataset("huge", shape=(10**13,), chunks=(1000,), dtype="f8").make_scale("huge")
    with pytest.raises(rumo.ArgumentError, match="claim to hold 800"):
        load(path)


NO_LOGS = {
    "no variable 'status'": lambda log: log.drop_vars("status"),
    "no variable 'time'": lambda log: log.drop_vars("time"),
    "no variable 'step_time'": lambda log: log.drop_vars("step_time"),
    "the variable 'applied' over": lambda log: log.assign(applied=("time", log["time"].to_numpy())),
    "the variable 'plant' of type int64, not floats": lambda log: log.assign(plant=log["plant"].astype(int)),
    "the variable 'status' of type float64, not text": lambda log: log.assign(status=log["time"].variable),
}


@pytest.mark.parametrize("lack", NO_LOGS)
def test_a_dataset_that_is_no_log_is_told(lack, kept, tmp_path):
    dataset, path = NO_LOGS[lack](kept[0]), tmp_path / "run.nc"
    with pytest.raises(rumo.ArgumentError, match=f"log: got a dataset with {lack}"):
        save(dataset, path)
    assert not path.exists()


def test_a_dataset_of_another_program_is_told(kept, tmp_path):
    lack, path = "no variable 'status'", tmp_path / "run.nc"
    NO_LOGS[lack](kept[0]).to_netcdf(path, engine="h5netcdf")
    with pytest.raises(rumo.ArgumentError, match=f"path: .*with {lack}"):
        load(path)


@pytest.mark.parametrize("text", ["a\0b", "a\ud800b", "a\x1bb", "a\nb"])
def test_text_that_files_do_not_keep_is_refused(text, kept, tmp_path):
    log, path = kept[0], tmp_path / "run.nc"
    for spoiled in (
        log.assign_attrs(title=text),
        log.assign_attrs({text: 1}),
        log.assign({text: log["time"]}),
        log.assign(plant=log["plant"].assign_attrs(note=text)),
        log.assign_coords(state_unit=("state", [text] * log.sizes["state"])),
    ):
        with pytest.raises(rumo.ArgumentError, match=r"log.*without control characters"):
            save(spoiled, path)
    assert not path.exists()
