"""Numbers of a problem change while its structure stays; what comes out is what would have been made anew."""

import re
from dataclasses import fields

import numpy as np
import pytest
from problems import pendulum

import rumo
from rumo.registry import CONTROLLERS

SOFT = rumo.Bounds(-3.0, 3.0, rumo.Penalty(5.0))


def rich(**changes):
    """A pendulum with every kind of number."""
    settings = {
        "track": {"angle": rumo.Weight(1.0, range=2.0), "rate": rumo.Weight(0.1, range=3.0)},
        "moves": {"torque": rumo.Weight(0.1, range=4.0)},
        "bounds": {"torque": (-2.0, 2.0), "rate": SOFT, "angle": (-9.0, 9.0)},
        "move_bounds": {"torque": (-1.0, 1.0)},
        "constraints": {"power": rumo.Constraint(lambda x, u, p: x.rate * u.torque, rumo.Penalty(3.0), 2.0)},
        "safe_input": {"torque": 0.5},
        "parameters": {"gravity": 9.0},
    }
    return pendulum(**(settings | changes))


W = rumo.Weight
STAGES = np.linspace(1.0, 2.0, 12)
BASE = {
    "track": {"angle": W(1.0, range=2.0), "rate": W(0.1, range=3.0)},
    "bounds": {"torque": (-2.0, 2.0), "rate": SOFT, "angle": (-9.0, 9.0)},
}
CHANGES = {
    "tracking weight": (
        {"weights": {"angle": 20.0}},
        {"track": BASE["track"] | {"angle": W(20.0, range=2.0)}},
    ),
    "tracking weights by stage": (
        {"weights": {"rate": STAGES}},
        {"track": BASE["track"] | {"rate": W(STAGES, range=3.0)}},
    ),
    "move weight": ({"weights": {"torque": 0.7}}, {"moves": {"torque": W(0.7, range=4.0)}}),
    "ranges": (
        {"ranges": {"angle": 0.3, "torque": 3.0}},
        {"track": BASE["track"] | {"angle": W(1.0, range=0.3)}, "moves": {"torque": W(0.1, range=3.0)}},
    ),
    "input bounds": ({"bounds": {"torque": (-1.0, 1.5)}}, {"bounds": BASE["bounds"] | {"torque": (-1.0, 1.5)}}),
    "input bounds by interval": (
        {"bounds": {"torque": (-STAGES, 1.5)}},
        {"bounds": BASE["bounds"] | {"torque": (-STAGES, 1.5)}},
    ),
    "state bounds keep their penalty": (
        {"bounds": {"rate": (-1.0, 2.0)}},
        {"bounds": BASE["bounds"] | {"rate": rumo.Bounds(-1.0, 2.0, rumo.Penalty(5.0))}},
    ),
    "state bounds by stage": (
        {"bounds": {"rate": (-1.0, STAGES)}},
        {"bounds": BASE["bounds"] | {"rate": rumo.Bounds(-1.0, STAGES, rumo.Penalty(5.0))}},
    ),
    "state bounds without a penalty keep theirs": (
        {"bounds": {"rate": rumo.Bounds(-1.0, 2.0)}},
        {"bounds": BASE["bounds"] | {"rate": rumo.Bounds(-1.0, 2.0, rumo.Penalty(5.0))}},
    ),
    "state bounds and penalty": (
        {"bounds": {"rate": rumo.Bounds(-1.0, 2.0, rumo.Penalty(7.0))}},
        {"bounds": BASE["bounds"] | {"rate": rumo.Bounds(-1.0, 2.0, rumo.Penalty(7.0))}},
    ),
    "state bounds made hard": (
        {"bounds": {"rate": rumo.Bounds(-1.0, 2.0)}, "penalties": {"rate": None}},
        {"bounds": BASE["bounds"] | {"rate": (-1.0, 2.0)}},
    ),
    "move bounds": ({"move_bounds": {"torque": (-0.2, 0.3)}}, {"move_bounds": {"torque": (-0.2, 0.3)}}),
    "limit": (
        {"limits": {"power": 0.5}},
        {"constraints": {"power": rumo.Constraint(lambda x, u, p: x.rate * u.torque, rumo.Penalty(3.0), 0.5)}},
    ),
    "limits by stage": (
        {"limits": {"power": STAGES}},
        {"constraints": {"power": rumo.Constraint(lambda x, u, p: x.rate * u.torque, rumo.Penalty(3.0), STAGES)}},
    ),
    "hard instead of soft": (
        {"penalties": {"power": None, "rate": None}},
        {
            "constraints": {"power": rumo.Constraint(lambda x, u, p: x.rate * u.torque, None, 2.0)},
            "bounds": BASE["bounds"] | {"rate": (-3.0, 3.0)},
        },
    ),
    "soft instead of hard": (
        {"penalties": {"angle": rumo.Penalty(2.0, 1.0)}},
        {"bounds": BASE["bounds"] | {"angle": rumo.Bounds(-9.0, 9.0, rumo.Penalty(2.0, 1.0))}},
    ),
    "safe input": ({"safe_input": {"torque": -1.0}}, {"safe_input": {"torque": -1.0}}),
    "parameters": ({"parameters": {"gravity": STAGES}}, {"parameters": {"gravity": STAGES}}),
    "nothing": ({}, {}),
}


def numbers(problem):
    return {field.name: getattr(problem.numbers, field.name) for field in fields(problem.numbers)}


@pytest.mark.parametrize("case", CHANGES)
def test_changed_is_what_would_have_been_made(case):
    changes, settings = CHANGES[case]
    problem = rich()
    before = numbers(problem)
    changed, made = problem.changed(**changes), rich(**settings)
    for name, array in numbers(made).items():
        np.testing.assert_array_equal(getattr(changed.numbers, name), array, err_msg=name)
        assert not getattr(changed.numbers, name).flags.writeable
    assert [(item.name, item.scale, item.penalty) for item in changed.constraints] == [
        (item.name, item.scale, item.penalty) for item in made.constraints
    ]
    # The problem itself is as it was, and shares what it is made of.
    assert all(numbers(problem)[name] is array for name, array in before.items())
    assert changed.model is problem.model
    assert changed._structure is problem._structure


@pytest.mark.parametrize("case", [name for name in CHANGES if "by" not in name])
@pytest.mark.parametrize("backend", ["portable", "reference"])
def test_it_gives_the_same_plans(case, backend):
    changes, settings = CHANGES[case]
    x, reference = [1.0, 2.0], {"angle": 0.0, "rate": 0.0}
    got, expected = (
        rumo.RealTimeIteration(problem, backend=backend).step(x, reference)
        for problem in (rich().changed(**changes), rich(**settings))
    )
    assert got.status is expected.status
    np.testing.assert_array_equal(got.u.values, expected.u.values)


def test_changes_add_up():
    problem = rich().changed(weights={"angle": 5.0}).changed(ranges={"angle": 10.0}).changed(weights={"rate": 2.0})
    np.testing.assert_array_equal(problem.output_weights[0], [5.0 / 100.0, 2.0 / 9.0])


def test_a_safe_input_that_was_not_given_follows_the_bounds():
    problem = pendulum().changed(bounds={"torque": (1.0, 2.0)})
    assert problem.safe_input.tolist() == [1.0]
    assert problem.changed(bounds={"torque": (-1.0, 2.0)}).safe_input.tolist() == [0.0]


def test_parameters_left_out_are_the_problems():
    problem = rich(parameters={"gravity": 7.0})
    assert problem.changed(parameters={}).parameters[0, 0] == 7.0
    assert problem.changed(weights={"angle": 2.0}).parameters[0, 0] == 7.0


@pytest.mark.parametrize("make", CONTROLLERS.values(), ids=CONTROLLERS)
def test_parameters_that_are_set_leave_the_others_at_the_problems(make):
    model = rumo.Model(
        states={"angle": "rad"},
        inputs={"torque": "N m"},
        dynamics=lambda x, u, p: {"angle": u.torque - p.a * x.angle + p.b},
        parameters={"a": rumo.Parameter("1", 1.0), "b": rumo.Parameter("1", 2.0)},
    )
    controller = make(pendulum(model=model, track={"angle": W(1.0)}, moves={"torque": W(1.0)}, parameters={"a": 5.0}))
    controller.parameters = {"b": 7.0}
    assert controller.parameters[0].tolist() == [5.0, 7.0]


def test_the_users_own_arrays_are_not_shared():
    weights = np.ones(12)
    problem = pendulum(track={"angle": W(weights)})
    weights[:] = 5.0
    assert problem.output_weights.max() == 1.0
    assert weights.flags.writeable


MISTAKES = {
    "unknown weight": (
        {"weights": {"angel": 1.0}},
        "weights: got 'angel', expected one of angle, rate, torque. Did you mean 'angle'?",
    ),
    "negative weight": ({"weights": {"angle": -1.0}}, "weights['angle']: got weight -1.0, expected non-negative"),
    "zero move weight": ({"weights": {"torque": 0.0}}, "weights['torque']: got weight 0.0, expected positive finite"),
    "weights of another horizon": (
        {"weights": {"angle": [1.0, 2.0]}},
        "weights['angle']: got 2 weights, expected one weight, or 12: one for each stage of the horizon.",
    ),
    "weight is a Weight": ({"weights": {"angle": W(1.0)}}, "weights['angle']: got Weight(value=1.0, range=1.0), exp"),
    "zero range": ({"ranges": {"angle": 0.0}}, "ranges['angle']: got 0.0, expected a positive finite number."),
    "crossed bounds": (
        {"bounds": {"torque": (2.0, -2.0)}},
        "bounds['torque']: got (2, -2), expected lower <= upper. Exchange the two bounds.",
    ),
    "crossed at an interval": (
        {"bounds": {"torque": (0.5, np.linspace(2.0, 0.0, 12))}},
        "bounds['torque'] at 9: got (0.5, 0.363636), expected lower <= upper.",
    ),
    "bounds of another horizon": (
        {"bounds": {"torque": (-1.0, [1.0, 2.0])}},
        "bounds['torque']: got 2 limits, expected one limit, or 12: one for each interval of the horizon.",
    ),
    "penalty on an input": (
        {"bounds": {"torque": rumo.Bounds(-1.0, 1.0, rumo.Penalty(1.0))}},
        "bounds['torque']: got a penalty on an input, expected hard bounds for inputs.",
    ),
    "a bound taken away": (
        {"bounds": {"rate": (-1.0, np.inf)}},
        "bounds['rate']: got upper bound inf, expected a finite bound at every stage where there is one at some. "
        "Give a number that the state never reaches.",
    ),
    "unknown bound": ({"bounds": {"rat": (-1.0, 1.0)}}, "bounds: got 'rat', expected one of torque, angle, rate."),
    "moves that forbid rest": (
        {"move_bounds": {"torque": (0.1, 0.5)}},
        "move_bounds['torque']: got (0.1, 0.5), expected an interval that contains 0.",
    ),
    "unknown limit": ({"limits": {"rate": 1.0}}, "limits: got 'rate', expected one of power. Limits of states and in"),
    "infinite limit": ({"limits": {"power": np.inf}}, "limits['power']: got inf, expected finite numbers."),
    "limits of another horizon": (
        {"limits": {"power": [1.0, 2.0]}},
        "limits['power']: got shape (2,), expected one number, or 12: one for each stage of the horizon.",
    ),
    "unknown penalty": ({"penalties": {"torque": None}}, "penalties: got 'torque', expected one of power, rate"),
    "penalty is a number": ({"penalties": {"rate": 5.0}}, "penalties['rate']: got 5.0, expected a rumo.Penalty."),
    "penalty of zero": (
        {"penalties": {"rate": rumo.Penalty(0.0)}},
        "penalties['rate']: got l1=0, l2=0, expected l1 > 0 and l2 >= 0, both finite.",
    ),
    "safe input outside new bounds": (
        {"bounds": {"torque": (1.0, 2.0)}},
        "safe_input['torque']: got 0.5, expected a value within the bounds (1, 2).",
    ),
    "NaN parameter": ({"parameters": {"gravity": np.nan}}, "parameters['gravity']: got nan, expected a finite number."),
    "a range whose square is zero": (
        {"ranges": {"angle": 1e-200}},
        "track['angle']: got 1 for a range of 1e-200, expected weights, penalties and ranges whose ratio is a number. "
        "Choose a unit in which the signal is neither tiny nor huge.",
    ),
    "a range whose square is infinite": (
        {"ranges": {"torque": 1e200}},
        "moves['torque']: got 0.1 for a range of 1e+200",
    ),
    "a weight lost over its range": (
        {"weights": {"torque": 1e-300}, "ranges": {"torque": 1e20}},
        "moves['torque']: got 1e-300 for a range of 1e+20",
    ),
    "bounds so narrow that prices are infinite": (
        {"bounds": {"rate": (0.0, 1e-310)}},
        "bounds['rate']: got 5 for a range of 1e-310",
    ),
    "weights are a list": ({"weights": [1.0]}, "weights: got [1.0], expected a mapping from names."),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_mistakes_raise_and_nothing_has_changed(case):
    changes, message = MISTAKES[case]
    problem = rich()
    before = numbers(problem)
    with pytest.raises(rumo.ArgumentError, match=re.escape(message)):
        problem.changed(**({"parameters": {"gravity": 3.0}} | changes))
    assert all(numbers(problem)[name] is array for name, array in before.items())


CROSSED = {"torque": (np.where(np.arange(12) == 5, 0.5, -1.0), np.where(np.arange(12) == 6, 0.2, 1.0))}


@pytest.mark.parametrize("blocks", [rumo.InputBlocks([4, 3, 4]), rumo.IncrementBlocks([4, 2, 5])], ids=repr)
@pytest.mark.parametrize(
    "make", [lambda b, **s: pendulum(blocks=b, **s), lambda b, **s: pendulum(blocks=b).changed(**s)]
)
def test_bounds_that_leave_a_block_no_value(make, blocks):
    assert pendulum(bounds=CROSSED).delay == 1
    message = (
        "bounds['torque']: got at least 0.5 and at most 0.2 within block 2 of the inputs, expected bounds that leave"
    )
    with pytest.raises(rumo.ArgumentError, match=re.escape(message)):
        make(blocks, bounds=CROSSED)


def test_numbers_are_scaled_when_a_problem_is_made():
    with pytest.raises(rumo.ArgumentError, match=r"track\['angle'\]: got 1 for a range of 1e-160"):
        pendulum(track={"angle": W(1.0, range=1e-160)})


def test_limits_without_a_row():
    cure = "Make it with one, as far away as you like, to have a row that can be changed."
    with pytest.raises(
        rumo.ArgumentError, match=re.escape("bounds['rate']: got upper bound 1, expected none: ") + ".*" + cure
    ):
        pendulum().changed(bounds={"rate": (-np.inf, 1.0)})
    with pytest.raises(
        rumo.ArgumentError, match=re.escape("move_bounds['torque']: got (-1, 1), expected none: the pro")
    ):
        pendulum().changed(move_bounds={"torque": (-1.0, 1.0)})
