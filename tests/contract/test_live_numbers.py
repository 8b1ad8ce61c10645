"""Numbers of a problem change between two samples, on every controller; and controllers take over without a bump."""

import numpy as np
import pytest
from problems import car, pendulum, swinging_cart

import rumo
from rumo import Status
from rumo.signals import NamedArray, Signals

REFERENCE = {"angle": 0.15, "rate": 0.0}
X = [0.1, 0.0]
MAKERS = {
    "portable": lambda problem: rumo.RealTimeIteration(problem, backend="portable"),
    "reference": lambda problem: rumo.RealTimeIteration(problem, backend="reference"),
    "nlp": lambda problem: rumo.DirectNlp(problem, tolerance=1e-10),
    "ltv": rumo.LinearTimeVarying,
}
every_controller = pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
CHANGES = {
    "weights": {"weights": {"angle": 20.0, "torque": 0.5}},
    "ranges": {"ranges": {"angle": 0.3, "torque": 1.0}},
    "bounds of an input": {"bounds": {"torque": (-0.4, 0.3)}},
    "bounds of each interval": {"bounds": {"torque": (-0.5, np.linspace(0.1, 0.9, 12))}},
    "bounds of a state": {"bounds": {"rate": (-0.05, 0.06)}},
    "bounds of each stage": {"bounds": {"rate": (-1.0, np.linspace(0.01, 0.2, 12))}},
    "move bounds": {"move_bounds": {"torque": (-0.1, 0.1)}},
    "limits": {"limits": {"cone": -0.35}},
    "penalties": {"bounds": {"rate": (-0.01, 0.01)}, "penalties": {"rate": rumo.Penalty(1e-3, 1e-3)}},
    "safe input": {"safe_input": {"torque": 0.2}},
    "parameters": {"parameters": {"gravity": 3.0}},
}


def problem():
    return pendulum(
        bounds={"torque": (-20.0, 20.0), "rate": rumo.Bounds(-5.0, 5.0, rumo.Penalty(10.0))},
        move_bounds={"torque": (-1.5, 1.5)},
        constraints={"cone": rumo.Constraint(lambda x, u, p: x.angle - 2.0 * x.rate - 0.4, rumo.Penalty(5.0))},
    )


@every_controller
@pytest.mark.parametrize("name", CHANGES)
def test_an_update_is_a_controller_made_anew(make, name):
    changes = CHANGES[name]
    controller = make(problem())
    before = controller.step(X, REFERENCE)
    controller.update(**changes)
    assert controller.status_counts.total() == 1  # nothing is forgotten
    controller.reset()
    updated, made = (each.step(X, REFERENCE) for each in (controller, make(controller.problem)))
    assert updated.status is made.status
    np.testing.assert_allclose(updated.u.values, made.u.values, atol=1e-7)
    np.testing.assert_allclose(updated.constraints.values, made.constraints.values, atol=1e-7)
    if name != "safe input":  # which is not needed yet
        assert not np.allclose(updated.u.values, before.u.values, atol=1e-3)


@every_controller
def test_an_update_holds_from_the_next_sample_on(make):
    controller = make(problem())
    for _ in range(3):
        controller.step(X, REFERENCE)
    controller.update(bounds={"torque": (-0.05, 0.05)})
    plan = controller.step(X, REFERENCE)
    assert np.abs(plan.u.values[controller.problem.delay :]).max() <= 0.05
    controller.update(safe_input={"torque": 0.03})
    plans = [controller.step([np.nan, 0.0], REFERENCE) for _ in range(20)]
    assert plans[-1].status is Status.PLAN_EXHAUSTED
    assert plans[-1].command["torque"] == 0.03


@every_controller
@pytest.mark.parametrize(
    "changes",
    [
        {"weights": {"angle": -1.0}},
        {"bounds": {"torque": (1.0, -1.0)}},
        {"bounds": {"torqe": (-1.0, 1.0)}},
        {"weights": {"angle": 3.0}, "penalties": {"rate": rumo.Penalty(0.0)}},
        {"safe_input": {"torque": 70.0}},
        {"parameters": {"gravity": np.nan}},
    ],
)
def test_a_wrong_number_changes_nothing(make, changes):
    controller, other = make(problem()), make(problem())
    before = controller.problem
    with pytest.raises(rumo.ArgumentError):
        controller.update(**changes)
    assert controller.problem is before
    first, second = (each.step(X, REFERENCE).u.values for each in (controller, other))
    np.testing.assert_array_equal(first, second)


def test_parameters_set_leave_the_others_and_survive_a_simulation():
    made, _, _ = car()
    start = dict.fromkeys(made.model.states, 0.0) | {"v_x": 8.0, "w_f": 8.0 / 0.3, "w_r": 8.0 / 0.3}
    windy = made.changed(parameters={"wind_speed": 4.0})
    controller = rumo.RealTimeIteration(windy)
    controller.parameters = {"wind_direction": 1.0}
    speed, direction = (made.model.parameters.index(name) for name in ("wind_speed", "wind_direction"))
    assert (controller.parameters[:, speed] == 4.0).all()
    rumo.simulate(controller, made.model, start, dict.fromkeys(made.outputs, 0.0) | {"v_x": 8.0}, 0.2)
    assert (controller.parameters[:, [speed, direction]] == [4.0, 1.0]).all()


@every_controller
def test_engaging_starts_from_what_the_actuators_do(make):
    controller = make(pendulum(move_bounds={"torque": (-0.1, 0.1)}))
    controller.step([3.0, 0.0], {"angle": -1.0, "rate": 0.0})
    controller.engage(applied={"torque": 1.5}, x=X)
    np.testing.assert_array_equal(controller.applied, [[1.5]])
    assert controller.status_counts.total() == 0
    assert abs(controller.step(X, REFERENCE).command["torque"] - 1.5) <= 0.1 + 1e-12


@pytest.mark.parametrize("backend", ["portable", "reference"])
def test_engaging_with_a_plan_linearises_about_it(backend):
    made, x, window = car()
    converged = rumo.RealTimeIteration(made, rumo.Radau2(), sqp_iterations=50, tolerance=1e-12)
    plan = converged.step(x, window)
    single = rumo.RealTimeIteration(made, rumo.Radau2(), backend=backend, trusted_step=np.inf)
    cold = single.step(x, window)
    single.engage(applied=made.safe_input, plan=plan)
    warm = single.step(x, window)
    far, near = (np.abs(each.u.values - plan.u.values).max() for each in (cold, warm))
    assert near < 1e-3 * far
    single.engage(applied=made.safe_input, plan={"x": plan.x, "u": plan.u})
    np.testing.assert_array_equal(single.step(x, window).u.values, warm.u.values)


@pytest.mark.parametrize(
    ("plan", "message"),
    [
        ({"u": np.zeros((12, 1))}, "no 'x'"),
        ({"u": np.zeros((5, 1)), "x": np.zeros((14, 2))}, r"plan\['u'\]: got shape \(5, 1\)"),
        ({"u": np.full((12, 1), np.nan), "x": np.zeros((13, 2))}, r"plan\['u'\]: got NaN or infinity"),
        (3.0, "plan: got 3.0, expected a mapping"),
        ({"u": [[0.0]] * 12, "x": [[0.0, 0.0]] * 13, "X": 0.0}, "plan: got 'X', expected one of x, u"),
        ({"u": np.zeros((12, 1)), "x": {"angle": 1.0}}, r"plan\['x'\]: got {'angle': 1.0}, expected numbers"),
        (
            {"u": NamedArray(Signals({"force": "N"}, "inputs"), np.zeros((12, 1))), "x": np.zeros((13, 2))},
            r"plan\['u'\]: got values of force, expected those of torque. Give arrays, in this order.",
        ),
    ],
)
def test_what_is_no_plan(plan, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        rumo.RealTimeIteration(pendulum()).engage(applied=[0.0], plan=plan)


@every_controller
def test_what_is_read_cannot_be_written_to_in_vain(make):
    controller = make(problem())
    for array in (controller.applied, controller.parameters):
        with pytest.raises(ValueError, match="assignment destination is read-only"):
            array[0] = 5.0
    controller.applied = [0.3]
    assert controller.applied.tolist() == [[0.3]]


def test_a_plan_is_explained_with_the_numbers_it_was_made_with():
    controller = rumo.RealTimeIteration(problem())
    plan = controller.step(X, {"angle": 40.0, "rate": 0.0})
    before, errors = str(controller.explain(plan)), controller.local_error(plan).values
    assert "moves as fast up as it may" in before
    controller.update(move_bounds={"torque": (-3.0, 3.0)}, parameters={"gravity": 20.0}, ranges={"torque": 1.0})
    assert plan.problem.parameters[0, 0] == 9.81
    assert str(controller.explain(plan)) == before
    np.testing.assert_array_equal(controller.local_error(plan).values, errors)


@every_controller
def test_an_update_after_the_preparation_prepares_again(make):
    controller, other = make(problem()), make(problem())
    for each in (controller, other):
        each.step(X, REFERENCE)
    controller.prepare()
    for each in (controller, other):
        each.update(weights={"angle": 5.0}, bounds={"torque": (-1.0, 1.0)})
    other.prepare()
    plans = [each.feedback(X, REFERENCE) for each in (controller, other)]
    np.testing.assert_allclose(plans[0].u.values, plans[1].u.values, atol=1e-7)


@pytest.mark.parametrize("backend", ["portable", "reference"])
@pytest.mark.parametrize(
    "changes",
    [{}, {"bounds": {"force": (-3.0, 3.0)}}, {"weights": {"angle": 9.0}}, {"parameters": {"gravity": 8.0}}],
    ids=str,
)
def test_a_second_preparation_is_the_first_with_other_numbers(backend, changes):
    made, x, reference = swinging_cart()
    plans = []
    for calls in ("update prepare", "prepare update", "prepare prepare update prepare"):
        controller = rumo.RealTimeIteration(made, backend=backend, preparation_iterations=1)
        for _ in range(2):
            controller.step(x, reference)
        for call in calls.split():
            controller.prepare() if call == "prepare" else controller.update(**changes)
        plans.append(controller.feedback([0.9, -0.3, 0.25, 0.2], reference))
    for plan in plans[1:]:
        np.testing.assert_allclose(plan.u.values, plans[0].u.values, rtol=0.0, atol=1e-9)
        assert plan.diagnostics.contraction == pytest.approx(plans[0].diagnostics.contraction, rel=1e-6)


def test_rows_that_become_hard_or_soft_lose_no_sample():
    controller = rumo.DirectNlp(problem())
    for penalty in (None, rumo.Penalty(1.0), None):
        controller.step(X, REFERENCE)
        controller.update(penalties={"rate": penalty})
        assert controller.step(X, REFERENCE).status.solved


@pytest.mark.parametrize("share", [1e-3, 1e-6])
def test_weights_that_shrink_leave_the_nlp_as_exact(share):
    controller = rumo.DirectNlp(problem())
    controller.step(X, REFERENCE)
    controller.update(
        weights={"angle": share, "torque": 0.1 * share},
        penalties={"rate": rumo.Penalty(10.0 * share), "cone": rumo.Penalty(5.0 * share)},
    )
    controller.reset()
    made = rumo.DirectNlp(controller.problem).step(X, REFERENCE)
    np.testing.assert_allclose(controller.step(X, REFERENCE).u.values, made.u.values, atol=1e-9)
