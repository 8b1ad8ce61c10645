"""What explains a plan: stiffness and local error against closed forms, limits by name and stage."""

import numpy as np
import pytest
from problems import advanced, car, cooled_reactor, pendulum, swinging_cart, tank

import rumo
from rumo.registry import CONTROLLERS, DISCRETIZATIONS
from rumo.simulation import Plant
from rumo.textbook import robertson_dae, robertson_reactor


def decay(rate=50.0, **changes):
    model = rumo.Model(
        states={"level": "1"}, inputs={"flow": "1/s"}, dynamics=lambda x, u, p: {"level": u.flow - rate * x.level}
    )
    settings = {
        "horizon": 6,
        "sampling_time": 0.1,
        "track": {"level": rumo.Weight(1.0)},
        "moves": {"flow": rumo.Weight(0.01)},
    }
    return rumo.Problem(model, **(settings | changes))


@pytest.mark.parametrize("make", CONTROLLERS.values(), ids=CONTROLLERS)
def test_every_controller_explains_itself(make):
    problem, x, window = car()
    controller = make(problem)
    explanation = controller.explain(controller.step(x, window))
    text = str(explanation)
    assert text.startswith("Outcome: Solved; every constraint that the inputs can influence holds.\n")
    assert f"{type(controller.transcription.discretization).__name__} takes 1." in text
    assert max(len(line) for line in text.splitlines()) < 250
    assert explanation.stiffness.shape == (problem.horizon,)


def test_stiffness_of_a_linear_model():
    problem = decay(horizon=rumo.Grid([0.1, 0.1, 0.2]))
    controller = rumo.RealTimeIteration(problem)
    explanation = controller.explain(controller.step([1.0], {"level": 0.0}))
    np.testing.assert_allclose(explanation.stiffness, [5.0, 5.0, 10.0])
    assert "up to 10, at stage 3; RK4 would need 4 steps in that interval" in str(explanation)


def test_algebraic_variables_do_not_change_the_stiffness():
    x, reference = {"a": 0.8, "b": 2.6e-5, "c": 0.199974}, {"a": 0.84}
    ratios = []
    for model in (robertson_reactor(), robertson_dae()):
        problem = rumo.Problem(
            model, horizon=5, sampling_time=2.0, track={"a": rumo.Weight(1.0)}, moves={"dilution": rumo.Weight(1.0)}
        )
        controller = rumo.RealTimeIteration(problem, sqp_iterations=20)
        plan = controller.step([x[name] for name in model.states], reference)
        ratios.append(controller.explain(plan).stiffness)
    np.testing.assert_allclose(ratios[1], ratios[0], rtol=1e-3)
    assert ratios[0].min() > 1000.0


def test_limits_by_name_and_stage():
    problem, x, reference = swinging_cart()
    controller = rumo.RealTimeIteration(problem, sqp_iterations=30)
    plan = controller.step(x, reference)
    explanation = controller.explain(plan)
    u, speed = plan.u["force"], plan.x["speed"][1:]
    assert explanation.active["force at its upper bound"] == [k + 1 for k in range(1, 25) if u[k] > 6.0 - 1e-6]
    assert explanation.active["speed_upper"] == [k + 1 for k in range(25) if abs(speed[k] - 0.8) < 1e-6]
    assert set(explanation.active) <= {f"force at its {side} bound" for side in ("lower", "upper")} | {
        "speed_upper",
        "speed_lower",
    }
    assert explanation.violated == {}
    assert "Violated: nothing." in str(explanation)


def test_moves_and_violations():
    soft = rumo.Bounds(-0.3, 0.3, rumo.Penalty(100.0))
    problem = pendulum(bounds={"rate": soft}, move_bounds={"torque": (-0.5, 0.4)})
    controller = rumo.RealTimeIteration(problem)
    plan = controller.step([0.0, 2.0], {"angle": 0.0})
    explanation = controller.explain(plan)
    moves = np.diff(plan.u["torque"])
    down = [k + 2 for k in range(11) if moves[k] < -0.5 + 1e-6]
    assert down
    assert explanation.active["torque moves as fast down as it may"] == down
    assert explanation.violated["rate_upper"] == sorted(
        item.stage for item in plan.violations if item.constraint == "rate_upper"
    )
    assert "Violated: rate_upper (stage" in str(explanation)


def test_without_a_plan():
    controller = rumo.RealTimeIteration(pendulum())
    explanation = controller.explain(controller.step([np.nan, 0.0], {"angle": 0.0}))
    assert np.isnan(explanation.stiffness).all()
    assert str(explanation).startswith(
        "Outcome: No plan is left to follow; the problem's safe input is applied. The meas"
    )
    assert "Stiffness" not in str(explanation)
    assert np.isnan(controller.local_error(controller.step([np.nan, 0.0], {"angle": 0.0})).values).all()


@pytest.mark.parametrize("method", ["explain", "local_error"])
def test_what_is_no_plan(method):
    with pytest.raises(rumo.ArgumentError, match=r"plan: got 'x', expected a rumo\.Plan"):
        getattr(rumo.RealTimeIteration(pendulum()), method)("x")


@pytest.mark.parametrize("name", DISCRETIZATIONS)
def test_local_error_is_that_of_one_interval(name):
    problem, x, reference = cooled_reactor()
    problem = rumo.Problem(
        problem.model,
        horizon=4,
        sampling_time=6.0,
        track={"c_b": rumo.Weight(1.0, range=0.2)},
        moves={"flow": rumo.Weight(0.1, range=15.0), "cooling": rumo.Weight(0.1, range=4000.0)},
        safe_input={"flow": 14.19, "cooling": -1113.5},
    )
    controller = rumo.RealTimeIteration(problem, DISCRETIZATIONS[name](), sqp_iterations=10)
    plan = controller.step(x, reference)
    estimated = controller.local_error(plan)
    exact = Plant(problem.model, 6.0, tolerance=1e-13)
    for k in range(problem.horizon):
        end = exact.advance(plan.x.values[k], plan.u.values[k], problem.parameters[k])
        once = advanced(controller, plan.x.values[k], plan.u.values[k])
        np.testing.assert_allclose(estimated.values[k], once - end, rtol=0.15, atol=1e-10 * np.abs(end).max())
    assert estimated["c_b"].shape == (4,)


def test_a_conflict_is_not_beside_a_list_of_no_limits():
    problem = pendulum(bounds={"torque": (-1.0, 1.0), "rate": (-0.1, 0.1)})
    controller = rumo.RealTimeIteration(problem)
    plan = controller.step([0.0, 3.0], {"angle": 0.0})
    assert plan.cause is rumo.Status.SOLVER_FAILED
    assert plan.conflict
    text = str(controller.explain(plan))
    assert f"In conflict: {'; '.join(plan.conflict)}." in text
    assert "At limits" not in text
    assert "Violated" not in text
    assert "limits" not in text


def test_constraints_are_not_known_without_a_solution():
    controller = rumo.RealTimeIteration(pendulum(bounds={"torque": (-1.0, 0.0), "rate": (-3.0, 3.0)}))
    text = str(controller.explain(controller.step([np.nan, 0.0], {"angle": 0.0})))
    where = "torque at its upper bound (stages 2 to 12)"
    assert f"Inputs at limits: {where}; path constraints are not known without a solution." in text


def test_without_a_plan_nothing_is_said_of_the_previous_one():
    controller = rumo.RealTimeIteration(pendulum())
    text = str(controller.explain(controller.step([np.nan, 0.0], {"angle": 0.0})))
    assert text.splitlines()[0] == (
        "Outcome: No plan is left to follow; the problem's safe input is applied. "
        "The measurement is not finite or implausible."
    )


@pytest.mark.parametrize("status", rumo.Status)
def test_a_reason_is_a_sentence(status):
    assert status.reason.endswith(".")
    assert status.value.startswith(status.reason[:-1])


@pytest.mark.parametrize("backend", ["portable", "reference"])
def test_where_the_model_has_no_value_it_says_so(backend):
    """The root of a level that the linearised prediction takes below zero."""
    controller = rumo.RealTimeIteration(tank(), backend=backend, gate=None, trusted_step=np.inf)
    plan = controller.step([2.0], {"level": 0.001})
    assert plan.status is rumo.Status.OPTIMAL
    dry = plan.x["level"][1:] < 0.0
    assert dry.any()
    explanation = controller.explain(plan)
    np.testing.assert_array_equal(np.isnan(explanation.stiffness), dry)
    assert "No value: the model or its derivatives give no finite numbers at the states predicted for" in str(
        explanation
    )
    assert f"stage {np.flatnonzero(dry)[-1] + 1}" in str(explanation) or f"to {np.flatnonzero(dry)[-1] + 1}" in str(
        explanation
    )
    assert ("Stiffness: " in str(explanation)) is not dry.all()


def test_steps_that_are_rounding_have_no_ratio():
    controller = rumo.RealTimeIteration(pendulum())
    for _ in range(3):
        plan = controller.step([0.0, 0.0], {"angle": 0.0})
    assert plan.diagnostics.step < 1e-6
    text = str(controller.explain(plan))
    assert "of the inputs' ranges, as good as none; KKT residual" in text
    assert "times the one before" not in text
