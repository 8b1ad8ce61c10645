"""Plants that are no models, and plants with algebraic variables to be measured."""

import numpy as np
import pytest
from problems import pendulum

import rumo
from rumo.simulation import ClosedLoop, Constant, Plant, PlantLike, Scenario
from rumo.simulation.foreign import as_plant


class Simulator:
    """The pendulum in someone else's simulator."""

    name = "theirs"
    sampling_time = 0.05

    def __init__(self):
        self.states = {"angle": "rad", "rate": "rad/s"}
        self.inputs = {"brake": "N", "torque": "N m"}
        self.parameters = {"gravity": rumo.Parameter("m/s^2", 9.81)}
        self.outputs = {"height": "m"}
        self.plant, self.resets = Plant(pendulum().model, 0.05), 0

    def advance(self, x, u, p):
        return self.plant.advance(x, u[1:], p)

    def observe(self, x, u, p):
        return {"height": x[0] ** 2}

    def reset(self):
        self.resets += 1


def run(plant, **changes):
    return Scenario(pendulum(), plant, [0.3, 0.0], {"angle": 0.1}, 0.5, **changes)


def test_anything_that_advances_is_a_plant():
    theirs = Simulator()
    assert isinstance(theirs, PlantLike)
    disturbances = {"gravity": Constant(5.0)}
    log = run(theirs, disturbances=disturbances).run()
    ours = run(pendulum().model, disturbances=disturbances).run()
    assert theirs.resets == 1
    assert log.attrs["plant_model"] == "theirs"
    for name in ("plant", "measured", "applied", "disturbance", "true_states"):
        np.testing.assert_array_equal(log[name], ours[name])


def test_its_outputs_can_be_measured():
    sensors = rumo.Sensors(measured=("angle", "rate", "height"))
    log = run(Simulator(), sensors=sensors).run()
    np.testing.assert_array_equal(log["measured_outputs"].data[:, 0], log["plant"].data[:, 0] ** 2)
    assert log["measured_output_unit"].data.tolist() == ["m"]


def test_the_least_that_is_a_plant():
    class Least:
        states = pendulum().model.states
        inputs = pendulum().model.inputs

        def advance(self, x, u, p):
            return [x[0] + 0.05 * x[1], x[1] + 0.05 * (u[0] - 9.81 * x[0])]

    log = run(Least()).run()
    assert log.attrs["plant_model"] == "Least"
    np.testing.assert_allclose(log["plant"][1], [0.3, -0.05 * 9.81 * 0.3])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"states": {"angle": "rad"}}, r"x: got shape \(2,\), expected shape \(1,\)"),
        (
            {"states": {"angle": "deg", "rate": "rad/s"}},
            "plant: got 'angle' in deg, expected the controller's unit, rad",
        ),
        ({"inputs": {"brake": "N"}}, "plant: got 'torque', expected one of brake"),
        ({"observe": None}, r"plant: got outputs without observe, expected a method observe\(x, u, p\)"),
        ({"outputs": {"rate": "rad/s"}}, "plant.outputs: got 'rate', a state, expected other names"),
        (
            {"observe": lambda x, u, p: {"height": 0.0, "angle": 1.0}},
            r"plant.observe\(\): got 'angle', expected one of h",
        ),
        ({"observe": lambda x, u, p: {}}, r"plant.observe\(\): got no value for height"),
        ({"sampling_time": "0.05"}, "plant.sampling_time: got '0.05', expected a positive number"),
        ({"sampling_time": 0.1}, "plant: got a sampling time of 0.1 s, expected the problem's 0.05 s"),
        ({"advance": lambda x, u, p: [0.0]}, r"plant.advance\(\): got shape \(1,\), expected shape \(2,\)"),
        ({"parameters": {"gravity": 9.81}}, r"parameters\['gravity'\]: got 9.81"),
    ],
)
def test_mistakes(changes, message):
    plant = Simulator()
    for name, value in changes.items():
        setattr(plant, name, value)
    with pytest.raises(rumo.ArgumentError, match=message):
        list(ClosedLoop(run(plant, sensors=rumo.Sensors(measured=("angle", "rate", "height")))))


@pytest.mark.parametrize(
    ("units", "sensors"),
    [
        ({"states": {"angle": "rad", "rate": "deg/s"}}, rumo.Sensors(measured=("angle",))),
        ({"outputs": {"height": "cm"}}, rumo.Sensors()),
    ],
)
def test_units_are_compared_of_what_nobody_measures_too(units, sensors):
    base = pendulum().model
    model = rumo.Model(
        dict(zip(base.states, base.states.units, strict=True)),
        {"torque": "N m"},
        lambda x, u, p: {"angle": x.rate, "rate": u.torque},
        outputs={"height": rumo.Output("m", lambda x, u, p: x.angle**2)},
    )
    problem = pendulum(model=model, track={"height": rumo.Weight(1.0)})
    plant = Simulator()
    vars(plant).update(units)
    with pytest.raises(rumo.ArgumentError, match=r"plant: got '\w+' in (deg/s|cm), expected the controller's unit"):
        ClosedLoop(Scenario(problem, plant, [0.3, 0.0], {"height": 0.1}, 0.5, sensors=sensors))


def test_a_class_is_no_plant():
    with pytest.raises(rumo.ArgumentError, match=r"plant: got <class .*expected a rumo.Model, or anything with states"):
        as_plant(Simulator, 0.05)


def charging():
    return rumo.Model(
        states={"charge": "C"},
        inputs={"voltage": "V"},
        dynamics=lambda x, u, p: {"charge": x.current},
        algebraic={"current": rumo.Algebraic("A", lambda x, u, p: u.voltage - 2.0 * x.current - x.charge / 0.5)},
        outputs={"heat": rumo.Output("W", lambda x, u, p: 2.0 * x.current**2)},
    )


def test_algebraic_variables_can_be_measured():
    model = charging()
    problem = rumo.Problem(
        model, horizon=5, sampling_time=0.1, track={"charge": rumo.Weight(1.0)}, moves={"voltage": rumo.Weight(0.1)}
    )
    sensors = rumo.Sensors(measured=("charge", "current", "heat"))
    log = Scenario(problem, model, [0.1], {"charge": 0.3}, 0.5, sensors=sensors).run()
    charge, before = log["plant"].data[:, 0], np.r_[0.0, log["applied"].data[:-1, 0]]
    current = 0.5 * (before - charge / 0.5)
    np.testing.assert_allclose(log["measured_outputs"], np.column_stack([current, 2.0 * current**2]), rtol=1e-9)


def test_plants_forget_the_last_run():
    model = rumo.Model(
        states={"x": "1", "sum": "1"},
        inputs={"u": "1"},
        dynamics=lambda x, u, p: {"x": u.u, "sum": x.root},
        algebraic={"root": rumo.Algebraic("1", lambda x, u, p: x.root**2 - x.x, guess=-1.0)},
    )
    plant = Plant(model, 0.5)
    nothing, start = np.zeros(0), np.array([1.0, 0.0])
    fresh = plant.advance(start, np.array([3.0]), nothing)
    plant.reset()
    np.testing.assert_array_equal(plant.advance(start, np.array([3.0]), nothing), fresh)


def test_a_plant_that_leaves_the_finite_numbers_is_an_error_of_the_plant():
    class Wild:
        states, inputs = {"angle": "rad", "rate": "rad/s"}, {"torque": "N m"}

        def advance(self, x, u, p):
            return [np.nan, 0.0]

    problem = pendulum()
    with pytest.raises(rumo.PlantError, match="left the finite numbers") as caught:
        rumo.simulate(rumo.RealTimeIteration(problem), Wild(), [0.1, 0.0], {"angle": 0.0}, 0.5)
    assert caught.value.log.sizes["time"] == 1


def test_a_controller_with_another_clock_is_refused():
    scenario = rumo.Scenario(pendulum(), pendulum().model, [0.1, 0.0], {"angle": 0.0}, 1.0)
    with pytest.raises(rumo.ArgumentError, match=r"controller: got one with samples of 0\.1 s"):
        scenario.run(rumo.RealTimeIteration(pendulum(sampling_time=0.1)))
