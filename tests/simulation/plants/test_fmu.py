"""FMUs as plants: one that solves the pendulum of `problems` exactly, compiled for FMI 2 and for FMI 3."""

import pickle
import zipfile
from copy import deepcopy

import numpy as np
import pytest
from problems import pendulum

import rumo
from rumo.kernel.tailored import CompilerError, compiler
from rumo.simulation import Constant, PlantLike, Scenario

pytest.importorskip("fmpy")
from pendulum_fmu import build, description

from rumo.simulation.plants import FmuPlant, Port

DT = 0.05
SIGNALS = {"states": ("angle", "rate")}


@pytest.fixture(scope="module", params=[2, 3])
def file(request, tmp_path_factory):
    try:
        command = compiler()
    except CompilerError as error:
        pytest.skip(str(error))
    return build(command, tmp_path_factory.mktemp("fmu"), request.param)


def plant(file, **changes):
    return FmuPlant(file, **{"sampling_time": DT, **changes})


def run(plant, **changes):
    return Scenario(pendulum(), plant, [0.3, 0.0], {"angle": 0.1}, 1.0, **changes)


def test_it_is_what_its_description_says(file):
    theirs = plant(file)
    assert isinstance(theirs, PlantLike)
    assert theirs.name == "their pendulum"
    assert dict(zip(theirs.states, theirs.states.units, strict=True)) == {"angle": "rad", "rate": "rad/s"}
    assert dict(zip(theirs.inputs, theirs.inputs.units, strict=True)) == {"torque": "N m"}
    assert theirs.parameters == {"gravity": rumo.Parameter("m/s^2", 9.81)}
    assert theirs.start() == {"angle": 0.1, "rate": 0.0}
    assert theirs.start(angle=0.7) == {"angle": 0.7, "rate": 0.0}


@pytest.mark.parametrize("steps", [1, 4])
def test_a_loop_is_the_same_as_with_our_model(file, steps):
    wanted = run(plant(file, steps=steps), disturbances={"gravity": Constant(5.0)})
    ours = run(pendulum().model, disturbances={"gravity": Constant(5.0)}).run()
    for log in (wanted.run(), wanted.run()):  # and again, from the beginning
        assert log.attrs["plant_model"] == "their pendulum"
        np.testing.assert_allclose(log["plant"], ours["plant"], atol=1e-6)
        np.testing.assert_allclose(log["applied"], ours["applied"], atol=1e-5)


def test_signals_have_names_and_units_of_ours(file):
    theirs = plant(
        file,
        states={"heading": Port("angle.degrees", "rad", np.pi / 180.0), "omega": Port("rate", start="rate_0")},
        inputs={"push": Port("torque", "kN m", 1e-3)},
        parameters=(),
        values={"gravity": 4.0},
    )
    assert (theirs.states.units, theirs.inputs.units) == (("rad", "rad/s"), ("kN m",))
    x = theirs.states.vector(theirs.start(omega=-0.1), "x")
    np.testing.assert_allclose(x, [0.1, -0.1])
    w, middle, push = 2.0, 0.5, np.array([2e-3])
    for k in range(1, 4):
        x = theirs.advance(x, push, np.zeros(0))
        angle = middle + (0.1 - middle) * np.cos(w * k * DT) - 0.1 / w * np.sin(w * k * DT)
        rate = -0.1 * np.cos(w * k * DT) - (0.1 - middle) * w * np.sin(w * k * DT)
        np.testing.assert_allclose(x, [angle, rate])


@pytest.mark.parametrize("steps", [1, 3])
def test_it_goes_on_by_parts_of_a_sample(file, steps):
    """Which the FMU takes only at the time where it is."""
    late = rumo.Actuation({"torque": rumo.Actuator(dead_time=0.02, lag=0.03)})
    theirs, ours = (
        Scenario(pendulum(delay=0), each, [0.3, 0.0], {"angle": 0.1}, 0.5, actuation=late).run()
        for each in (plant(file, steps=steps), rumo.Plant(pendulum().model, DT, 1e-12))
    )
    np.testing.assert_allclose(theirs["plant"], ours["plant"], atol=1e-8)


def test_one_of_fixed_steps_goes_on_by_samples(tmp_path):
    with zipfile.ZipFile(tmp_path / "fixed.fmu", "w") as packed:
        fixed = description(2).replace(' canHandleVariableCommunicationStepSize="true"', "")
        packed.writestr("modelDescription.xml", fixed)
    late = rumo.Actuation({"torque": rumo.Actuator(lag=0.03)})
    scenario = Scenario(
        pendulum(delay=0), plant(tmp_path / "fixed.fmu"), [0.1, 0.0], {"angle": 0.1}, 0.5, actuation=late
    )
    with pytest.raises(rumo.ArgumentError, match="their pendulum, which goes on by whole samples"):
        scenario.run()


def test_a_start_in_another_unit_is_noticed(file):
    theirs = plant(file, states={"heading": Port("angle.degrees", "rad", np.pi / 180.0, start="angle")})
    with pytest.raises(rumo.ArgumentError, match=r"x\['heading'\]: got 0.2, expected 11.4592, where their pendulum"):
        theirs.advance(np.array([0.2]), np.zeros(1), np.array([9.81]))


def test_copies_are_plants_of_their_own(file):
    theirs = plant(file)
    x, u, p = np.array([0.1, 0.0]), np.array([0.5]), np.array([9.81])
    first = theirs.advance(x, u, p)
    for other in (deepcopy(theirs), pickle.loads(pickle.dumps(theirs))):
        np.testing.assert_array_equal(other.advance(x, u, p), first)
    second = theirs.advance(first, u, p)
    assert not np.array_equal(second, first)
    with pytest.raises(rumo.CallOrderError, match=r"goes on from where it is, .* Call reset\(\) first"):
        theirs.advance(first, u, p)
    theirs.reset()
    np.testing.assert_array_equal(theirs.advance(x, u, p), first)


def test_it_says_where_it_begins(file):
    theirs = plant(file)
    with pytest.raises(rumo.ArgumentError, match=r"x\['rate'\]: got 0.5, expected 0, where their pendulum begins"):
        theirs.advance(np.array([0.3, 0.5]), np.zeros(1), np.array([9.81]))
    assert theirs.advance(np.array([0.3, 0.0]), np.zeros(1), np.array([9.81]))[0] < 0.3  # a mistake that is forgotten
    with pytest.raises(rumo.ArgumentError, match=r"rate: got 0.5, expected nothing: the FMU does not let it be set"):
        theirs.start(rate=0.5)
    with pytest.raises(rumo.UnknownNameError, match="start: got 'speed', expected one of angle, rate"):
        theirs.start(speed=0.5)
    assert plant(file, states={"angle": "angle", "rate": Port("rate", start="rate_0")}).start(rate=0.5)["rate"] == 0.5
    assert plant(file, values={"rate_0": 0.25}).start() == {"angle": 0.1, "rate": 0.25}


def test_what_it_cannot_do_is_an_error_of_the_plant(file):
    theirs = plant(file)
    with pytest.raises(rumo.PlantError, match=r"DoStep failed with status 3"):
        theirs.advance(np.array([0.1, 0.0]), np.array([200.0]), np.array([9.81]))
    if file.name == "pendulum3.fmu":  # FMUs of FMI 2 cannot say that they have come to an end
        theirs.reset()
        with pytest.raises(rumo.PlantError, match=r"ended at 0.05 s, within the step from 0 s on"):
            theirs.advance(np.array([0.1, 0.0]), np.array([60.0]), np.array([9.81]))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"states": ("angel",)}, r"states\['angel'\]: got 'angel', expected one of .* Did you mean 'angle'"),
        ({"states": ()}, "states: got none, expected at least one"),
        ({"states": "angle"}, "states: got 'angle', expected names, or a mapping"),
        ({"states": ("angle.degrees",)}, "states: got the name 'angle.degrees', expected a Python identifier"),
        ({"inputs": {"torque": Port("torque", start="nothing")}}, r"inputs\['torque'\]: got 'nothing'"),
        ({"parameters": ("rate_0",)}, r"parameters\['rate_0'\]: got 'rate_0', expected a tunable parameter.*values="),
        ({"values": {"mass": 1.0}}, "values: got 'mass', expected one of"),
        ({"values": {"gravity": "heavy"}}, r"values\['gravity'\]: got 'heavy'"),
        ({"sampling_time": -1.0}, "sampling_time: got -1.0"),
        ({"steps": 0}, "steps: got 0"),
    ],
)
def test_mistakes(file, changes, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        plant(file, **changes)


def test_a_port_with_a_factor_has_a_unit():
    with pytest.raises(rumo.ArgumentError, match="unit: got None, expected the unit of a signal that is 2 times"):
        Port("angle", factor=2.0)
    with pytest.raises(rumo.ArgumentError, match="factor: got 0"):
        Port("angle", "rad", 0.0)


def test_files_that_are_none(tmp_path):
    with pytest.raises(rumo.FileError, match=r"missing.fmu: got .*, expected an FMU for co-simulation"):
        FmuPlant(tmp_path / "missing.fmu", sampling_time=DT)
    for version in (2, 3):
        exchange = description(version).replace("CoSimulation", "ModelExchange")
        exchange = exchange.replace(' canHandleVariableCommunicationStepSize="true"', "")
        with zipfile.ZipFile(tmp_path / "exchange.fmu", "w") as packed:
            packed.writestr("modelDescription.xml", exchange)
        with pytest.raises(rumo.FileError, match=r"got one for model exchange alone, of FMI"):
            FmuPlant(tmp_path / "exchange.fmu", sampling_time=DT)
        with zipfile.ZipFile(tmp_path / "empty.fmu", "w") as packed:
            packed.writestr("modelDescription.xml", description(version))
        empty = FmuPlant(tmp_path / "empty.fmu", sampling_time=DT)
        with pytest.raises(rumo.FileError, match=r"got an FMU that cannot be loaded .* expected one for this system"):
            empty.start()
