"""Wrong use raises at once; the message names argument, value, expectation and cure."""

import math
import re
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from problems import pendulum

import rumo
from rumo.controllers import InnovationGate
from rumo.estimation import Butterworth
from rumo.references import Following, Sine, SinePath
from rumo.registry import CONTROLLERS, MODELS
from rumo.simulation import Constant, Gust, OrnsteinUhlenbeck, Plant, Sensors
from rumo.vehicles import (
    PAPER_CAR,
    Dugoff,
    VehicleParameters,
    dynamic_bicycle,
    four_wheel,
    friction_circles,
)

W = rumo.Weight


def model(**changes):
    settings = {
        "states": {"angle": "rad", "rate": "rad/s"},
        "inputs": {"torque": "N m"},
        "dynamics": lambda x, u, p: {"angle": x.rate, "rate": u.torque},
    }
    return rumo.Model(**(settings | changes))


MODEL_MISTAKES = {
    "states must be a mapping": (
        {"states": ["angle", "rate"]},
        "states: got ['angle', 'rate'], expected a mapping from name to unit",
    ),
    "no states": ({"states": {}}, "states: got no state, expected at least one."),
    "no inputs": ({"inputs": {}}, "inputs: got no input, expected at least one."),
    "bad name": (
        {"inputs": {"motor torque": "N m"}},
        "inputs: got the name 'motor torque', expected a Python identifier",
    ),
    "unit is no text": ({"inputs": {"torque": 1}}, "inputs['torque']: got 1, expected a unit as text."),
    "name used twice": (
        {"inputs": {"rate": "N m"}, "dynamics": lambda x, u, p: {}},
        "inputs: got the name 'rate', also among the states, expected names used once. Rename one.",
    ),
    "missing derivative": (
        {"dynamics": lambda x, u, p: {"angle": x.rate}},
        "dynamics: got no derivative of rate, expected one for each state.",
    ),
    "unknown derivative": (
        {"dynamics": lambda x, u, p: {"angle": x.rate, "rat": u.torque}},
        "dynamics: got 'rat', expected one of angle, rate. Did you mean 'rate'?",
    ),
    "parameter that is none": (
        {"dynamics": lambda x, u, p: {"angle": x.rate, "rate": u.torque / p.mass}},
        "parameters: got 'mass', expected nothing: no name exists here. Add it to the model's parameters",
    ),
    "algebraic variable without an equation": (
        {"algebraic": {"force": 1.0}},
        "algebraic['force']: got 1.0, expected a rumo.Algebraic. Write rumo.Algebraic(",
    ),
    "algebraic guess is NaN": (
        {"algebraic": {"force": rumo.Algebraic("N", lambda x, u, p: x.force - u.torque, guess=np.nan)}},
        "algebraic guesses['force']: got nan, expected a finite number.",
    ),
    "equations of index 2": (
        {"algebraic": {"force": rumo.Algebraic("N", lambda x, u, p: x.angle - 1.0)}},
        "algebraic: got equations that do not determine all of force, expected equations of index 1.",
    ),
    "algebraic variable named like a state": (
        {"algebraic": {"rate": rumo.Algebraic("N", lambda x, u, p: x.rate - 1.0)}},
        "algebraic: got the name 'rate', also among the states, expected names used once. Rename one.",
    ),
    "not a mapping": ({"dynamics": lambda x, u, p: [x.rate, u.torque]}, "dynamics: got list, expected a mapping"),
    "vector expression": (
        {"dynamics": lambda x, u, p: {"angle": ca.vertcat(x.rate, x.rate), "rate": u.torque}},
        "dynamics['angle']: got an expression of shape (2, 1), expected a scalar expression.",
    ),
    "foreign symbol": (
        {"dynamics": lambda x, u, p: {"angle": x.rate, "rate": ca.SX.sym("gravity")}},
        "dynamics['rate']: got the foreign symbol 'gravity', expected an expression of the states, inputs and "
        "parameters. Declare it as a parameter of the model.",
    ),
    "comparison": (
        {"dynamics": lambda x, u, p: {"angle": x.rate, "rate": x.angle <= 1.0}},
        "expected an expression with a value. Write x - 1.0 for x <= 1.0.",
    ),
    "NaN in dynamics": (
        {"dynamics": lambda x, u, p: {"angle": x.rate, "rate": u.torque + np.nan}},
        "with NaN or infinity in it, expected finite numbers.",
    ),
    "parameter is a number": (
        {"parameters": {"mass": 1.0}},
        "parameters['mass']: got 1.0, expected a rumo.Parameter. Write rumo.Parameter(\"kg\", 1.0).",
    ),
    "output is a function": (
        {"outputs": {"height": lambda x, u, p: x.angle}},
        "expected a rumo.Output. Write rumo.Output(",
    ),
    "private name": ({"inputs": {"_torque": "N m"}}, "inputs: got the name '_torque', expected a Python identifier"),
    "a condition": (
        {"dynamics": lambda x, u, p: {"angle": x.rate, "rate": u.torque if x.angle > 0 else 0.0}},
        "dynamics: got an expression of signals where Python needs true or false (if, and, or, not, max, min), "
        "expected one formula for all values. Write ca.if_else(x.v > 0, a, b) for a condition",
    ),
    "a maximum": (
        {"dynamics": lambda x, u, p: {"angle": x.rate, "rate": max(u.torque, 0.0)}},
        "Write ca.if_else(x.v > 0, a, b) for a condition, ca.fmax(a, b) and ca.fmin(a, b)",
    ),
    "math": (
        {"dynamics": lambda x, u, p: {"angle": x.rate, "rate": u.torque - math.sin(x.angle)}},
        "with NaN or infinity in it, expected finite numbers. If it comes from math.sin(x.v): that takes numbers only. "
        "Write ca.sin(x.v).",
    ),
    "an index": (
        {"dynamics": lambda x, u, p: {"angle": x.rate, "rate": [1.0, 2.0][int(x.angle)]}},
        "dynamics: got an expression of signals where a number is needed (",
    ),
    "all states at once": (
        {"dynamics": lambda x, u, p: {"angle": x.rate, "rate": 2.0 * x}},
        "dynamics: got an expression of signals where a number is needed (unsupported operand type",
    ),
    "dynamics of two arguments": (
        {"dynamics": lambda x, u: {"angle": x.rate, "rate": u.torque}},
        "dynamics: got a function of (x, u), expected a function of (x, u, p): states, inputs, parameters. Write "
        "lambda x, u, p: ..., also where not all are used.",
    ),
    "dynamics are no function": ({"dynamics": 5}, "dynamics: got 5, expected a function (x, u, p) -> expression."),
    "output of one argument": (
        {"outputs": {"height": rumo.Output("m", lambda x: x.angle)}},
        "outputs['height']: got a function of (x), expected a function of (x, u, p)",
    ),
    "condition in an output": (
        {"outputs": {"height": rumo.Output("m", lambda x, u, p: 1 if x.angle > 0 else 2)}},
        "outputs['height']: got an expression of signals where Python needs true or false",
    ),
    "equation of two arguments": (
        {"algebraic": {"force": rumo.Algebraic("N", lambda x, u: x.force)}},
        "algebraic['force'].equation: got a function of (x, u), expected a function of (x, u, p)",
    ),
    "not an expression": (
        {"dynamics": lambda x, u, p: {"angle": x.rate, "rate": "torque"}},
        "dynamics['rate']: got 'torque', expected a CasADi SX expression or a number.",
    ),
    "NaN parameter": (
        {"parameters": {"mass": rumo.Parameter("kg", np.nan)}},
        "parameters['mass']: got nan, expected a finite number.",
    ),
}


@pytest.mark.parametrize("case", MODEL_MISTAKES)
def test_model(case):
    changes, message = MODEL_MISTAKES[case]
    with pytest.raises(rumo.ArgumentError, match=re.escape(message)):
        model(**changes)


def test_unknown_signal_in_dynamics_is_an_attribute_error_with_a_hint():
    with pytest.raises(AttributeError, match=r"'rat', expected one of angle, rate\. Did you mean 'rate'\?"):
        model(dynamics=lambda x, u, p: {"angle": x.rat, "rate": u.torque})


def test_a_users_own_mistake_stays_what_it_is():
    with pytest.raises(KeyError, match="mass"):
        model(dynamics=lambda x, u, p: {"angle": x.rate, "rate": u.torque / {}["mass"]})


def test_numpys_functions_of_scalars_work_without_a_word():
    x = model(dynamics=lambda x, u, p: {"angle": x.rate, "rate": u.torque - np.sin(x.angle)})
    assert float(x.f([0.5, 0.0], [0.0], [])[1]) == pytest.approx(-np.sin(0.5))


@pytest.mark.parametrize("name", MODELS)
def test_what_can_be_tracked_is_what_is_proposed(name):
    plant = MODELS[name]()
    settings = {"horizon": 3, "sampling_time": 0.1, "moves": {key: W(1.0) for key in plant.inputs}}
    with pytest.raises(rumo.UnknownNameError) as caught:
        rumo.Problem(plant, track={"nothing_like_it": W(1.0)}, **settings)
    proposed = str(caught.value).split("expected one of ")[1].split(". ")[0].split(", ")
    rumo.Problem(plant, track={key: W(1.0) for key in proposed}, **settings)


PROBLEM_MISTAKES = {
    "horizon zero": ({"horizon": 0}, "horizon: got 0, expected a whole number of at least 1."),
    "horizon not whole": ({"horizon": 2.5}, "horizon: got 2.5, expected a whole number"),
    "negative sampling time": ({"sampling_time": -0.1}, "sampling_time: got -0.1, expected a positive finite number."),
    "NaN sampling time": ({"sampling_time": np.nan}, "sampling_time: got nan, expected a positive finite number."),
    "delay too long": ({"delay": 12}, "delay: got 12, expected less than the horizon of 12."),
    "negative delay": ({"delay": -1}, "delay: got -1, expected a whole number of at least 0."),
    "nothing tracked": ({"track": {}}, "track: got nothing, expected at least one of angle, rate."),
    "unknown tracked signal": (
        {"track": {"angel": W(1.0)}},
        "track: got 'angel', expected one of angle, rate. Did you mean 'angle'?",
    ),
    "tracked input": (
        {"track": {"torque": W(1.0)}},
        "track: got 'torque', expected one of angle, rate. Inputs are no outputs by themselves: "
        'outputs={"...": rumo.Output(..., lambda x, u, p: u.torque)}.',
    ),
    "condition in a constraint": (
        {"constraints": {"limit": rumo.Constraint(lambda x, u, p: x.angle if x.rate > 0 else 0.0)}},
        "constraints['limit']: got an expression of signals where Python needs true or false",
    ),
    "constraint of two arguments": (
        {"constraints": {"limit": rumo.Constraint(lambda x, u: x.angle)}},
        "constraints['limit']: got a function of (x, u), expected a function of (x, u, p)",
    ),
    "weight is a number": (
        {"track": {"angle": 1.0}},
        "track['angle']: got 1.0, expected a rumo.Weight. Write rumo.Weight(1.0, range=...).",
    ),
    "weight of the wrong length": (
        {"track": {"angle": W([1.0, 2.0])}},
        "track['angle']: got 2 weights, expected one weight, or 12: one for each stage of the horizon.",
    ),
    "negative weight": ({"track": {"angle": W(-1.0)}}, "track['angle']: got weight -1.0, expected non-negative"),
    "NaN weight": ({"track": {"angle": W(np.nan)}}, "track['angle']: got weight nan, expected non-negative finite"),
    "zero range": (
        {"track": {"angle": W(1.0, range=0.0)}},
        "track['angle'].range: got 0.0, expected a positive finite",
    ),
    "no weight for an input": ({"moves": {}}, "moves: got no weight for 'torque', expected a positive weight"),
    "zero move weight": ({"moves": {"torque": W(0.0)}}, "moves['torque']: got weight 0.0, expected positive finite"),
    "unknown move": ({"moves": {"force": W(1.0)}}, "moves: got 'force', expected one of torque."),
    "crossed bounds": (
        {"bounds": {"torque": (2.0, -2.0)}},
        "bounds['torque']: got (2, -2), expected lower <= upper. Exchange the two bounds.",
    ),
    "NaN bound": ({"bounds": {"torque": (np.nan, 2.0)}}, "bounds['torque']: got (nan, 2.0), expected numbers."),
    "empty bound": ({"bounds": {"rate": (np.inf, np.inf)}}, "bounds['rate']: got (inf, inf), expected an interval"),
    "bound is no pair": ({"bounds": {"torque": 2.0}}, "bounds['torque']: got 2.0, expected a pair (lower, upper)."),
    "unknown bound": ({"bounds": {"speed": (0.0, 1.0)}}, "bounds: got 'speed', expected one of torque, angle, rate."),
    "soft input bound": (
        {"bounds": {"torque": rumo.Bounds(-1.0, 1.0, rumo.Penalty(1.0))}},
        "bounds['torque']: got a penalty on an input, expected hard bounds for inputs.",
    ),
    "moves that forbid rest": (
        {"move_bounds": {"torque": (0.1, 0.5)}},
        "move_bounds['torque']: got (0.1, 0.5), expected an interval that contains 0.",
    ),
    "bare function as constraint": (
        {"constraints": {"limit": lambda x, u, p: x.angle}},
        "expected a rumo.Constraint",
    ),
    "vector constraint": (
        {"constraints": {"limit": rumo.Constraint(lambda x, u, p: ca.vertcat(x.angle, x.rate))}},
        "constraints['limit']: got an expression of shape (2, 1), expected a scalar expression.",
    ),
    "constraint without a proper name": (
        {"constraints": {"torque limit": rumo.Constraint(lambda x, u, p: u.torque)}},
        "constraints: got the name 'torque limit', expected a Python identifier such as 'yaw_rate'.",
    ),
    "constraint on nothing": (
        {"constraints": {"limit": rumo.Constraint(lambda x, u, p: p.gravity - 10.0)}},
        "which neither states nor inputs change, expected an expression of states or inputs.",
    ),
    "constraint without a function": (
        {"constraints": {"limit": rumo.Constraint(5.0)}},
        "constraints['limit']: got 5.0, expected a function (x, u, p) -> expression.",
    ),
    "comparison as constraint": (
        {"constraints": {"limit": rumo.Constraint(lambda x, u, p: x.angle <= 0.2)}},
        "expected an expression with a value. Write x - 1.0 for x <= 1.0.",
    ),
    "penalty is text": (
        {"constraints": {"limit": rumo.Constraint(lambda x, u, p: x.angle, rumo.Penalty("high"))}},
        "constraints['limit'].penalty.l1: got 'high', expected a number.",
    ),
    "model is no model": ({"model": "pendulum"}, "model: got 'pendulum', expected a rumo.Model."),
    "track is a list": ({"track": ["angle"]}, "track: got ['angle'], expected a mapping from names."),
    "weight is text": ({"track": {"angle": W("high")}}, "track['angle']: got 'high', expected numbers."),
    "bounds of None": (
        {"bounds": {"rate": rumo.Bounds(None, 2.0)}},
        "bounds['rate']: got (None, 2.0), expected a pair",
    ),
    "safe input is a list": ({"safe_input": [1.0]}, "safe_input: got [1.0], expected a mapping from names."),
    "penalty of zero": (
        {"constraints": {"limit": rumo.Constraint(lambda x, u, p: x.angle, rumo.Penalty(0.0))}},
        "constraints['limit'].penalty: got l1=0, l2=0, expected l1 > 0 and l2 >= 0, both finite.",
    ),
    "constraint named like a bound": (
        {
            "constraints": {"rate_upper": rumo.Constraint(lambda x, u, p: x.rate)},
            "bounds": {"rate": (-1.0, 1.0)},
        },
        "constraints['rate_upper']: got a name that a state bound uses, expected another name.",
    ),
    "unsafe safe input": (
        {"safe_input": {"torque": 5.0}},
        "safe_input['torque']: got 5, expected a value within the bounds (-2, 2).",
    ),
    "NaN safe input": ({"safe_input": {"torque": np.nan}}, "safe_input['torque']: got nan, expected a finite number."),
    "grid that begins with another step": (
        {"horizon": rumo.Grid.geometric(5, 0.05, 1.5)},
        "horizon: got a grid that begins with steps of 0.05, 0.075 s, expected 2 of the sampling time, 0.05 s.",
    ),
    "blocks of too many intervals": (
        {"blocks": rumo.InputBlocks([4, 4, 4])},
        "blocks: got 12 intervals in all, expected 11: the horizon of 12 without the delay of 1.",
    ),
    "blocks as a list": (
        {"blocks": [1, 10]},
        "blocks: got [1, 10], expected a rumo.MoveBlocks. Write rumo.InputBlocks([1, 1, 2, 4]).",
    ),
    "parameters of another horizon": (
        {"parameters": {"gravity": [9.81, 9.82]}},
        "parameters['gravity']: got shape (2,), expected one number, or 12: one for each interval of the horizon.",
    ),
    "parameter that is NaN": (
        {"parameters": {"gravity": np.nan}},
        "parameters['gravity']: got nan, expected a finite number.",
    ),
    "unknown parameter": ({"parameters": {"mass": 1.0}}, "parameters: got 'mass', expected one of gravity."),
    "NaN parameter": ({"parameters": {"gravity": np.nan}}, "parameters['gravity']: got nan, expected a finite number."),
}


@pytest.mark.parametrize("case", PROBLEM_MISTAKES)
def test_problem(case):
    changes, message = PROBLEM_MISTAKES[case]
    with pytest.raises(rumo.ArgumentError, match=re.escape(message)):
        pendulum(**changes)


STEP_MISTAKES = {
    "short state": (([0.1], {"angle": 0.0}), "x: got shape (1,), expected shape (2,). One value each for angle, rate."),
    "matrix state": ((np.zeros((2, 1)), {"angle": 0.0}), "x: got shape (2, 1), expected shape (2,)."),
    "text state": ((["a", "b"], {"angle": 0.0}), "x: got ['a', 'b'], expected 2 numbers."),
    "unknown state": (
        ({"angle": 0.0, "speed": 1.0}, {"angle": 0.0}),
        "x: got no value for rate, expected all of angle",
    ),
    "extra state": (
        ({"angle": 0.0, "rate": 0.0, "speed": 1.0}, {"angle": 0.0}),
        "x: got 'speed', expected one of angle, rate.",
    ),
    "missing reference": (([0.0, 0.0], {}), "reference: got no values for 'angle', expected values for every tracked"),
    "unknown reference": (([0.0, 0.0], {"angle": 0.0, "rte": 0.0}), "reference: got 'rte', expected one of angle,"),
    "short reference": (
        ([0.0, 0.0], {"angle": np.zeros(12)}),
        "reference['angle']: got shape (12,), expected one number or 13, from now to t + N.",
    ),
    "reference array": (
        ([0.0, 0.0], np.zeros((12, 1))),
        "reference: got shape (12, 1), expected (13, 1): N + 1 by tracked outputs.",
    ),
    "one window too many": (
        ([0.0, 0.0], np.zeros((1, 13, 1))),
        "reference: got shape (1, 13, 1), expected (13, 1): N + 1 by tracked outputs.",
    ),
    "text reference": (([0.0, 0.0], {"angle": "up"}), "reference['angle']: got 'up', expected numbers."),
}


@pytest.mark.parametrize("case", STEP_MISTAKES)
@pytest.mark.parametrize("name", CONTROLLERS)
def test_step(name, case):
    arguments, message = STEP_MISTAKES[case]
    controller = CONTROLLERS[name](pendulum())
    with pytest.raises(rumo.ArgumentError, match=re.escape(message)):
        controller.step(*arguments)
    # Nothing is lost: the next proper call works.
    assert controller.step([0.0, 0.0], {"angle": 0.0, "rate": 0.0}).status.solved


def test_feedback_without_preparation():
    controller = rumo.RealTimeIteration(pendulum())
    with pytest.raises(rumo.CallOrderError, match="call prepare"):
        controller.feedback([0.0, 0.0], {"angle": 0.0})
    controller.prepare()
    controller.feedback([0.0, 0.0], {"angle": 0.0})
    with pytest.raises(rumo.CallOrderError, match="call prepare"):
        controller.feedback([0.0, 0.0], {"angle": 0.0})


def test_applied_inputs():
    controller = rumo.RealTimeIteration(pendulum(delay=2))
    with pytest.raises(rumo.ShapeError, match=re.escape("applied: got shape (3, 1), expected shape (2, 1) or (1,).")):
        controller.applied = np.zeros((3, 1))
    with pytest.raises(rumo.ArgumentError, match=re.escape("applied: got [[nan], [0.0]], expected finite inputs.")):
        controller.reset(applied=[[np.nan], [0.0]])


def test_reset_to_a_state_that_is_not_finite():
    with pytest.raises(rumo.ArgumentError, match=re.escape("x['rate']: got inf, expected a finite number.")):
        rumo.RealTimeIteration(pendulum()).reset(x=[0.0, np.inf])


def test_ltv_needs_every_state():
    controller = rumo.LinearTimeVarying(pendulum())
    with pytest.raises(
        rumo.ArgumentError, match=r"reference: got no values for rate, .* linearises along the reference"
    ):
        controller.step([0.0, 0.0], {"angle": 0.0})


def test_ltv_asks_for_every_state_before_it_judges_the_sample():
    controller, other = (rumo.LinearTimeVarying(pendulum(), gate=InnovationGate(patience=1)) for _ in range(2))
    reference = {"angle": 0.0, "rate": 0.0}
    for each in (controller, other):
        each.step([0.0, 0.0], reference)
        each.prepare()
    for x in ([np.nan, 0.0], [100.0, 0.0], [100.0, 0.0]):
        with pytest.raises(rumo.ArgumentError, match="reference: got no values for rate"):
            controller.feedback(x, {"angle": 0.0})
    assert controller.status_counts.total() == 1
    plans = [each.feedback([100.0, 0.0], reference) for each in (controller, other)]
    assert [plan.status for plan in plans] == [rumo.Status.BAD_MEASUREMENT] * 2


def test_a_controller_needs_a_problem():
    with pytest.raises(
        rumo.ArgumentError, match=re.escape("problem: got Model(model: 2 states, 1 inputs), expected a")
    ):
        rumo.RealTimeIteration(model())


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: rumo.QpOptions(max_iterations=2.5), "QpOptions.max_iterations: got 2.5, expected a whole number"),
        (lambda: rumo.QpOptions(max_iterations=-1), "QpOptions.max_iterations: got -1, expected a whole number"),
        (lambda: rumo.QpOptions(tolerance=0.0), "QpOptions.tolerance: got 0.0, expected a positive finite number"),
        (lambda: rumo.QpOptions(tolerance=10), "QpOptions.tolerance: got 10, expected at most 0.001"),
        (
            lambda: rumo.NlpSettings(tolerance=-1.0),
            "NlpSettings.tolerance: got -1.0, expected a positive finite",
        ),
        (lambda: rumo.NlpSettings(max_iterations=-1), "NlpSettings.max_iterations: got -1, expected a whole number"),
        (lambda: rumo.NlpSettings(max_wall_time=0.0), "NlpSettings.max_wall_time: got 0.0, expected a positive"),
        (lambda: Gust(1.0, 2.0, start=0.0, duration=0.0), "duration: got 0.0, expected a positive finite number"),
        (lambda: OrnsteinUhlenbeck(1.0, 2.0, 0.0), "correlation_time: got 0.0, expected a positive finite number"),
        (lambda: SinePath(amplitude="3"), "amplitude: got '3', expected a finite number"),
        (lambda: SinePath(vehicle=3), "vehicle: got 3, expected what knows its rolling"),
        (lambda: Sine("angle", 0.0, np.nan, 1.0), "amplitude: got nan, expected a finite number"),
        (lambda: Following(3), "path: got 3, expected a function of times such as SinePath"),
        (lambda: Following(SinePath(), ()), "position: got no names, expected some such as"),
        (lambda: SinePath(wavelength=0.0), "wavelength: got 0.0, expected a positive finite number"),
    ],
)
def test_options(make, message):
    with pytest.raises(rumo.ArgumentError, match=re.escape(message)):
        make()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"sqp_iterations": 0}, "sqp_iterations: got 0, expected a whole number of at least 1"),
        ({"preparation_iterations": -1}, "preparation_iterations: got -1, expected a whole number of at least 0"),
        ({"tolerance": -1.0}, "tolerance: got -1.0, expected a number of at least 0"),
        ({"integrator_tolerance": np.nan}, "integrator_tolerance: got nan, expected a number of at least 0"),
    ],
)
def test_iterations(options, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        rumo.RealTimeIteration(pendulum(), **options)


SIMULATION_MISTAKES = {
    "short initial state": ({"x": [0.0]}, "x: got shape (1,), expected shape (2,)."),
    "NaN initial state": ({"x": [0.0, np.nan]}, "x['rate']: got nan, expected a finite number."),
    "no time": ({"duration": 0.0}, "duration: got 0.0, expected at least one sampling time of 0.05 s, finite."),
    "NaN time": ({"duration": np.nan}, "duration: got nan, expected at least one sampling time"),
    "no end": ({"duration": np.inf}, "duration: got inf, expected at least one sampling time of 0.05 s, finite."),
    "negative seed": ({"seed": -1}, "seed: got -1, expected a whole number of at least 0."),
    "reference is a number": ({"reference": 3.0}, "reference: got 3.0, expected a function of times, or a mapping"),
    "reference is arrays": (
        {"reference": {"angle": np.zeros(21)}},
        "reference['angle']: got shape (21,), expected a number. Give a function of times.",
    ),
    "reference returns an array": ({"reference": np.zeros_like}, "reference(t): got array("),
    "sensors are a mapping": ({"sensors": {"angle": 0.1}}, "sensors: got {'angle': 0.1}, expected a rumo.Sensors."),
    "estimator is a class": (
        {"estimator": Butterworth},
        "estimator: got Butterworth, expected settings such as Butterworth(cutoff=3.5).",
    ),
    "plant is no model": ({"plant": 3.0}, "plant: got 3.0, expected a rumo.Model, or anything with states, inputs and"),
    "unknown plant": (
        {"plant": "pendulum"},
        "plant: got 'pendulum', expected one of dynamic_bicycle, four_wheel, cart_pendulum",
    ),
    "plant in other units": (
        {"plant": model(states={"angle": "deg", "rate": "rad/s"})},
        "plant: got 'angle' in deg, expected the controller's unit, rad. Rumo does not convert units.",
    ),
    "plant with another clock": (
        {"plant": Plant(model(), 0.1)},
        "plant: got a sampling time of 0.1 s, expected the problem's 0.05 s.",
    ),
    "unknown noise": (
        {"sensors": Sensors({"angel": 0.1})},
        "noise: got 'angel', expected one of angle, rate. Did you mean 'angle'?",
    ),
    "negative noise": (
        {"sensors": Sensors({"angle": -0.1})},
        "noise['angle']: got -0.1, expected a standard deviation",
    ),
    "unknown disturbance": (
        {"disturbances": {"wind": Constant(2.0)}},
        "disturbances: got 'wind', expected one of gravity.",
    ),
}


@pytest.mark.parametrize("case", SIMULATION_MISTAKES)
def test_simulate(case):
    changes, message = SIMULATION_MISTAKES[case]
    controller = rumo.RealTimeIteration(pendulum())
    settings = {"plant": controller.problem.model, "x": [0.0, 0.0], "reference": {"angle": 0.0}, "duration": 1.0}
    with pytest.raises(rumo.ArgumentError, match=re.escape(message)):
        rumo.simulate(controller, **(settings | changes))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: four_wheel(3), "parameters: got 3, expected a rumo.VehicleParameters. Write rumo.vehicles.PAPER_CAR"),
        (lambda: friction_circles(VehicleParameters), "parameters: got VehicleParameters, expected a rumo.Vehicle"),
        (lambda: dynamic_bicycle(PAPER_CAR, Dugoff), "tyre: got <class"),
        (lambda: four_wheel(PAPER_CAR, "dugoff"), "tyre: got 'dugoff', expected a tyre such as rumo.vehicles.Dugoff()"),
        (lambda: dynamic_bicycle(PAPER_CAR, as_printed=True), "as_printed: got True, expected a rumo.AsPrinted."),
        (lambda: replace(PAPER_CAR, front=0.9), "VehicleParameters.front: got 0.9, expected a rumo.TyreParameters."),
        (
            lambda: replace(PAPER_CAR, b_lon=np.nan),
            "VehicleParameters.b_lon: got nan, expected a number of at least 0.",
        ),
    ],
)
def test_cars(make, message):
    with pytest.raises(rumo.ArgumentError, match=re.escape(message)):
        make()


def test_load_transfer_without_a_height():
    with pytest.raises(
        rumo.ArgumentError, match=re.escape("load_transfer: got True with h = 0 m, expected a car whose")
    ):
        four_wheel(PAPER_CAR, load_transfer=True)


def test_a_problem_cannot_be_changed_behind_its_controllers():
    with pytest.raises(ValueError, match="read-only"):
        pendulum().parameters[0] = 1.0


def test_every_error_is_a_rumo_error():
    for error in (
        rumo.ArgumentError,
        rumo.ShapeError,
        rumo.UnknownNameError,
        rumo.CallOrderError,
        rumo.PlantError,
        rumo.FrozenError,
    ):
        assert issubclass(error, rumo.RumoError)


def test_a_model_cannot_be_read_by_an_unknown_name():
    with pytest.raises(rumo.UnknownNameError, match="expected one of angle, rate"):
        model().unit("torqe")


@pytest.mark.parametrize("make", CONTROLLERS.values(), ids=CONTROLLERS)
@pytest.mark.parametrize(
    ("scheme", "message"),
    [
        ("radau2", "discretization: got 'radau2', expected a rumo.Discretization. Write rumo.ImplicitEuler()."),
        (rumo.Radau2, "discretization: got Radau2, expected a rumo.Discretization. Write rumo.ImplicitEuler()."),
        (
            rumo.Rk4(),
            "discretization: got Rk4, which is explicit, expected an implicit scheme for a model with algebraic "
            "variables.",
        ),
    ],
)
def test_schemes(make, scheme, message):
    algebraic = {"force": rumo.Algebraic("N", lambda x, u, p: x.force - u.torque)}
    problem = pendulum(model=model(algebraic=algebraic))
    with pytest.raises(rumo.ArgumentError, match=re.escape(message)):
        make(problem, scheme)


@pytest.mark.parametrize("substeps", [0, 1.5, True])
def test_substeps(substeps):
    with pytest.raises(rumo.ArgumentError, match=f"substeps: got {substeps}, expected a whole number of at least 1"):
        rumo.Radau2(substeps=substeps)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: rumo.Grid([]), "steps: got [], expected a list of interval lengths such as [0.05, 0.05, 0.1]."),
        (lambda: rumo.Grid(5), "steps: got 5, expected a list of interval lengths"),
        (lambda: rumo.Grid([0.1, -0.1]), "steps[1]: got -0.1, expected a positive finite number."),
        (lambda: rumo.Grid.geometric(5, 0.1, 0.0), "ratio: got 0.0, expected a positive finite number."),
        (lambda: rumo.Grid.geometric(0, 0.1, 1.1), "intervals: got 0, expected a whole number of at least 1."),
        (lambda: rumo.InputBlocks([]), "lengths: got [], expected a list of block lengths such as [1, 1, 2, 4]."),
        (lambda: rumo.IncrementBlocks([1, 0]), "lengths[1]: got 0, expected a whole number of at least 1."),
    ],
)
def test_grids_and_blocks(make, message):
    with pytest.raises(rumo.ArgumentError, match=re.escape(message)):
        make()


UNKEPT = ("a\0b", "a\ud800b", "a\x1b[2Jb", "a\nb")
"""Text that files, terminals or C do not keep."""


@pytest.mark.parametrize("text", UNKEPT)
@pytest.mark.parametrize(
    ("enter", "argument"),
    [
        (lambda text: model(name=text), "name"),
        (lambda text: model(states={"angle": text, "rate": "1"}), "states['angle']"),
        (lambda text: model(states={text: "1", "angle": "1", "rate": "1"}), "states"),
        (lambda text: model(inputs={"torque": text}), "inputs['torque']"),
        (lambda text: model(parameters={"mass": rumo.Parameter(text, 1.0)}), "parameters['mass']"),
        (lambda text: model(parameters={text: rumo.Parameter("kg", 1.0)}), "parameters"),
        (lambda text: model(outputs={"power": rumo.Output(text, lambda x, u, p: x.rate)}), "outputs['power']"),
        (lambda text: model(outputs={text: rumo.Output("W", lambda x, u, p: x.rate)}), "outputs"),
        (lambda text: pendulum(constraints={text: rumo.Constraint(lambda x, u, p: x.angle)}), "constraints"),
        (lambda text: pendulum(track={text: W(1.0)}), "track"),
        (lambda text: pendulum(bounds={text: (0.0, 1.0)}), "bounds"),
        (lambda text: pendulum(parameters={text: 1.0}), "parameters"),
        (lambda text: rumo.Recorder(rumo.RealTimeIteration(pendulum()), measured={"angle": text}), "measured['angle']"),
    ],
)
def test_text_that_is_not_kept_is_refused_where_it_is_entered(enter, argument, text):
    with pytest.raises(rumo.ArgumentError) as error:
        enter(text)
    assert str(error.value).startswith(f"{argument}: got ")
    assert str(error.value).isprintable(), "the message can be printed"


BEYOND = {
    "bounds['torque']": (
        lambda: pendulum(bounds={"torque": (-1.7e308, 1.7e308)}),
        lambda: pendulum(bounds={"torque": (-1e308, 1.0)}),
        lambda: pendulum(bounds={"torque": (-(10**400), 1.0)}),
        lambda: pendulum(moves={"torque": W(1.0, 1e-20)}, bounds={"torque": (-1e300, 1e300)}),
        lambda: pendulum().changed(bounds={"torque": (-1.7e308, 1.7e308)}),
    ),
    "bounds['angle']": (lambda: pendulum(bounds={"angle": (-1.7e308, 1.7e308)}),),
    "move_bounds['torque']": (
        lambda: pendulum(move_bounds={"torque": (-1.7e308, 1.7e308)}),
        lambda: pendulum(moves={"torque": W(1.0, 1e-20)}, bounds={}, move_bounds={"torque": (-1e300, 1e300)}),
    ),
    "constraints['far'].limit": (
        lambda: pendulum(constraints={"far": rumo.Constraint(lambda x, u, p: x.angle, limit=1.7e308)}),
    ),
    "safe_input['torque']": (
        lambda: pendulum(moves={"torque": W(1.0, 1e-20)}, bounds={}, safe_input={"torque": 1e300}),
        lambda: pendulum(bounds={}, safe_input={"torque": 10**400}),
    ),
    "track['angle'].range": (
        lambda: pendulum(track={"angle": W(1.0, 5e-324)}),
        lambda: pendulum(track={"angle": W(1.0, 10**400)}),
    ),
    "track['angle']": (
        lambda: pendulum(track={"angle": W(1e300, 1e-10)}),
        lambda: pendulum(track={"angle": W(1e-300, 1e10)}),
        lambda: pendulum(track={"angle": W(10**400)}),
    ),
    "moves['torque']": (
        lambda: pendulum(moves={"torque": W(1.0, 1e-160)}),
        lambda: pendulum(moves={"torque": W(5e-324)}),
    ),
    "parameters['gravity']": (lambda: pendulum(parameters={"gravity": 10**400}),),
    "sampling_time": (
        lambda: pendulum(sampling_time=5e-324),
        lambda: pendulum(sampling_time=1.7e308),
        lambda: pendulum(sampling_time=10**400),
    ),
    "horizon": (lambda: pendulum(sampling_time=1.0, horizon=rumo.Grid([1.0, 1.0, 1.7e308, 1.7e308])),),
    "steps[3]": (lambda: rumo.Grid.geometric(4, 1.0, 1e150, equal=1),),
    "QpOptions.tolerance": (lambda: rumo.QpOptions(tolerance=5e-324),),
    "InnovationGate.width": (lambda: InnovationGate(width=10**400),),
    "trusted_step": (lambda: rumo.Settings(trusted_step=10**400),),
    "tolerance": (lambda: rumo.Settings(tolerance=10**400),),
    "constraints['far'].penalty": (
        lambda: pendulum(constraints={"far": rumo.Constraint(lambda x, u, p: x.angle, rumo.Penalty(10**400))}),
        lambda: pendulum(constraints={"far": rumo.Constraint(lambda x, u, p: x.angle, rumo.Penalty(1.0, 10**400))}),
    ),
    "Measurement.noise": (lambda: rumo.Measurement(noise=10**400),),
    "duration": (
        lambda: rumo.Scenario(pendulum(), model(), [0.1, 0.0], {"angle": 0.0}, 1e308),
        lambda: rumo.Scenario(pendulum(), model(), [0.1, 0.0], {"angle": 0.0}, 10**400),
    ),
}


@pytest.mark.parametrize(("argument", "make"), [(argument, make) for argument in BEYOND for make in BEYOND[argument]])
def test_numbers_that_overflow_are_refused_where_they_are_entered(argument, make):
    with pytest.raises(rumo.ArgumentError) as error:
        make()
    assert str(error.value).startswith(f"{argument}: got ")
    assert ", expected " in str(error.value)
