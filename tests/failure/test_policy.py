"""The failure policy, level by level: what is applied, and what the status says."""

import numpy as np
import pytest
from problems import pendulum, reference_with, swinging_cart, tank

import rumo
from rumo import Status
from rumo.controllers import NlpSettings, QpOptions
from rumo.controllers.engines.qp import Solution, solve

CONTROLLERS = [rumo.RealTimeIteration, rumo.DirectNlp, rumo.LinearTimeVarying]
REFERENCE = {"angle": 0.5, "rate": 0.0}
GOOD = [0.1, 0.0]


@pytest.mark.parametrize("bad", [[np.nan, 0.0], [0.1, np.inf], [-np.inf, np.nan]])
@pytest.mark.parametrize("make", CONTROLLERS)
def test_bad_measurement_follows_the_shifted_plan_and_recovers(make, bad):
    controller = make(pendulum())
    good = controller.step(GOOD, REFERENCE)
    assert good.status is Status.OPTIMAL
    for samples_later in (1, 2, 3):
        plan = controller.step(bad, REFERENCE)
        assert plan.status is Status.BAD_MEASUREMENT
        # delay 1: the command of the sample itself is good.u[1]
        np.testing.assert_array_equal(plan.command.values, good.u.values[1 + samples_later])
    assert controller.status_counts == {Status.OPTIMAL: 1, Status.BAD_MEASUREMENT: 3}
    assert controller.step(GOOD, REFERENCE).status is Status.OPTIMAL


@pytest.mark.parametrize("make", CONTROLLERS)
def test_recovery_is_complete(make):
    # After bad samples the next plan equals that of a controller which never saw them.
    troubled, fresh = make(pendulum()), make(pendulum())
    troubled.step(GOOD, REFERENCE)
    for _ in range(4):
        troubled.step([np.nan, np.nan], REFERENCE)
    fresh.reset(applied=troubled.applied)
    ours, expected = troubled.step([0.3, 0.1], REFERENCE), fresh.step([0.3, 0.1], REFERENCE)
    np.testing.assert_allclose(ours.u.values, expected.u.values, atol=1e-6)


@pytest.mark.parametrize("make", CONTROLLERS)
def test_exhausted_plan_goes_to_the_safe_input_within_move_bounds(make):
    problem = pendulum(horizon=4, safe_input={"torque": -1.0}, move_bounds={"torque": (-0.25, 0.25)})
    controller = make(problem)
    controller.reset(applied=[0.5])
    assert controller.step(GOOD, REFERENCE).status is Status.OPTIMAL
    statuses, commands = [], [controller.applied[-1, 0]]
    for _ in range(12):
        plan = controller.step([np.nan, 0.0], REFERENCE)
        statuses.append(plan.status)
        commands.append(plan.command["torque"])
    # Horizon 4 with delay 1 chose inputs 1, 2, 3; the first was used at once.
    assert statuses == [Status.BAD_MEASUREMENT] * 2 + [Status.PLAN_EXHAUSTED] * 10
    assert np.abs(np.diff(commands)).max() <= 0.25 + 1e-12
    assert commands[-1] == -1.0
    assert controller.step(GOOD, REFERENCE).status is Status.OPTIMAL


@pytest.mark.parametrize("make", CONTROLLERS)
def test_nothing_known_yet_means_the_safe_input(make):
    controller = make(pendulum(safe_input={"torque": 0.3}))
    plan = controller.step([np.nan, 0.0], REFERENCE)
    assert plan.status is Status.PLAN_EXHAUSTED
    assert plan.cause is Status.BAD_MEASUREMENT
    assert plan.command["torque"] == 0.3
    assert np.isnan(plan.x.values).all()
    assert np.isnan(plan.slacks.values).all()


@pytest.mark.parametrize("make", CONTROLLERS)
def test_bad_reference_is_a_status(make):
    controller = make(pendulum())
    good = controller.step(GOOD, REFERENCE)
    plan = controller.step(GOOD, {"angle": np.nan, "rate": 0.0})
    assert plan.status is Status.BAD_REFERENCE
    np.testing.assert_array_equal(plan.command.values, good.u.values[2])


@pytest.mark.parametrize("make", CONTROLLERS)
@pytest.mark.parametrize("missing", [np.nan, np.inf, -np.inf])
def test_a_reference_may_be_missing_where_it_has_no_weight(make, missing):
    """At stage 0, and at stages and in outputs without a weight: the plan is that of any other number there."""
    model = rumo.Model(
        {"angle": "rad", "rate": "rad/s"},
        {"torque": "N m"},
        lambda x, u, p: {"angle": x.rate, "rate": u.torque - 9.81 * x.angle},
        outputs={
            "tilt": rumo.Output("rad", lambda x, u, p: x.angle),
            "swing": rumo.Output("rad/s", lambda x, u, p: x.rate),
        },
    )
    weights = np.array([1.0] * 4 + [0.0] * 3 + [1.0] * 4 + [0.0])
    problem = pendulum(model=model, track={"tilt": rumo.Weight(weights), "swing": rumo.Weight(0.0)})
    tilt = np.full(13, 0.5)
    whole = {"tilt": tilt, "swing": 2.0, "angle": 0.5, "rate": 0.0}
    holes = np.where(np.isin(np.arange(13), [0, 5, 6, 7, 12]), missing, tilt)
    holey = whole | {"tilt": holes, "swing": missing}
    if make is not rumo.LinearTimeVarying:  # which linearises about the states' reference
        holey |= {"angle": missing, "rate": missing}
    told, untold = make(problem), make(problem)
    for _ in range(3):
        expected, plan = told.step(GOOD, whole), untold.step(GOOD, holey)
        assert plan.status is expected.status is Status.OPTIMAL
        np.testing.assert_array_equal(plan.u.values, expected.u.values)
    holes[8] = missing
    assert untold.step(GOOD, holey).status is Status.BAD_REFERENCE


@pytest.mark.parametrize("make", CONTROLLERS)
def test_infeasible_hard_constraints_apply_the_shifted_plan(make):
    problem = pendulum(bounds={"torque": (-2.0, 2.0), "angle": (-1.0, 1.0)})
    controller = make(problem, gate=None)
    good = controller.step(GOOD, REFERENCE)
    plan = controller.step([5.0, 0.0], REFERENCE)  # no torque within bounds brings the angle below 1 rad at once
    assert plan.status is Status.SOLVER_FAILED
    np.testing.assert_array_equal(plan.command.values, good.u.values[2])
    assert controller.step(GOOD, REFERENCE).status is Status.OPTIMAL


@pytest.mark.parametrize("make", CONTROLLERS)
@pytest.mark.parametrize("delay", [1, 2, 3])
def test_a_constraint_that_no_free_input_can_influence_is_reported_not_imposed(make, delay):
    problem = pendulum(delay=delay, bounds={"torque": (-2.0, 2.0), "rate": (-1.0, 1.0)}, parameters={"gravity": 0.0})
    controller = make(problem)
    x = [0.0, 1.05]  # above the bound until the first free input acts, which can take it below in one sample
    controller.reset(applied=np.zeros((delay, 1)))
    plan = controller.step(x, REFERENCE)
    assert plan.status is Status.OPTIMAL
    assert plan.slacks["rate_upper"][0] > 0.0
    assert np.all(plan.slacks.values[delay:] < 1e-6)


def test_a_constraint_on_a_state_that_inputs_never_reach_is_left_out():
    model = rumo.Model(
        states={"driven": "1", "alone": "1"},
        inputs={"push": "1"},
        dynamics=lambda x, u, p: {"driven": u.push - x.driven, "alone": -x.alone},
    )
    problem = rumo.Problem(
        model,
        horizon=5,
        sampling_time=0.1,
        track={"driven": rumo.Weight(1.0)},
        moves={"push": rumo.Weight(0.1)},
        bounds={"alone": (-1.0, 1.0)},
    )
    for make in CONTROLLERS:
        plan = make(problem).step([0.0, 3.0], {"driven": 1.0, "alone": 0.0})
        assert plan.status is Status.OPTIMAL
        assert plan.slacks["alone_upper"][0] == pytest.approx(3.0 / 1.1 - 1.0)


@pytest.mark.parametrize("penalty", [None, rumo.Penalty(1.0)])
def test_a_constraint_without_numerical_influence(penalty):
    """It takes part in nothing; exceeded, it is none that holds, and a hard one leaves no solution."""
    # Structurally the input reaches the constraint, but with a factor that is zero here.
    model = rumo.Model(
        states={"a": "1", "b": "1"},
        inputs={"push": "1"},
        dynamics=lambda x, u, p: {"a": u.push - x.a, "b": p.gain * x.a - x.b},
        parameters={"gain": rumo.Parameter("1", 0.0)},
    )
    problem = rumo.Problem(
        model,
        horizon=5,
        sampling_time=0.1,
        track={"a": rumo.Weight(1.0)},
        moves={"push": rumo.Weight(0.1)},
        bounds={"b": rumo.Bounds(-1.0, 1.0, penalty)},
    )
    controller = rumo.RealTimeIteration(problem)
    plan = controller.step([0.0, 0.9], {"a": 1.0})
    assert plan.status is Status.OPTIMAL
    assert plan.command["push"] > 0.1
    plan = controller.step([0.0, 3.0], {"a": 1.0})
    assert plan.cause is (Status.SOFT_VIOLATED if penalty else Status.SOLVER_FAILED)
    assert plan.command["push"] > 0.1
    assert ("b_upper at stage 1" in plan.conflict) is (penalty is None)


def test_a_failed_qp_is_never_applied():
    failing = False

    def optimize(program, options):
        wrong = Solution(np.full(len(program.gradient), 1e6), Status.SOLVER_FAILED)
        return wrong if failing else solve(program, options)

    controller = reference_with(pendulum(), optimize)
    good = controller.step(GOOD, REFERENCE)
    failing = True
    plan = controller.step(GOOD, REFERENCE)
    assert plan.status is Status.SOLVER_FAILED
    np.testing.assert_array_equal(plan.command.values, good.u.values[2])
    failing = False
    assert controller.step(GOOD, REFERENCE).status is Status.OPTIMAL


def test_an_empty_qp_budget_is_a_status():
    controller = rumo.RealTimeIteration(pendulum(), backend="reference")
    good = controller.step(GOOD, REFERENCE)
    controller.configure(qp=QpOptions(max_iterations=1))
    plan = controller.step(GOOD, REFERENCE)
    assert plan.status is Status.BUDGET_EXCEEDED
    np.testing.assert_array_equal(plan.command.values, good.u.values[2])


def test_nlp_out_of_budget_uses_an_iterate_only_if_it_satisfies_the_dynamics():
    problem, x, reference = swinging_cart()
    seen = []
    for iterations in range(0, 24, 3):
        controller = rumo.DirectNlp(problem, settings=NlpSettings(max_iterations=iterations))
        plan = controller.step(x, reference)
        seen.append(plan.status)
        assert plan.cause in (Status.BUDGET_EXCEEDED, Status.OPTIMAL)
        if plan.status is Status.BUDGET_EXCEEDED:
            # One Newton step onto the dynamics hardly moves the states that it promised.
            stages = controller.transcription.linearize(
                plan.x.values, plan.u.values, np.zeros((len(plan.u), 0)), problem.parameters
            )
            step = np.linalg.solve(stages.M, stages.defect[:, :, None])
            assert np.abs(step).max() < 0.02
    assert seen[0] is Status.PLAN_EXHAUSTED  # no iterate yet, and no earlier plan
    assert seen[-1] is Status.OPTIMAL
    assert Status.BUDGET_EXCEEDED in seen


def test_a_guess_where_the_model_has_no_value_is_repaired():
    controller = rumo.RealTimeIteration(tank(), gate=None)
    statuses = [controller.step([level], {"level": 0.02}).status for level in (1.0, 0.4, 0.1, 0.02, 1.0, 1.0)]
    assert statuses[-1] is Status.OPTIMAL
    # Started at a negative level there is nothing to linearise; at the next good sample there is again.
    controller.reset()
    assert not controller.step([-1.0], {"level": 1.0}).status.solved
    assert controller.step([1.0], {"level": 1.0}).status is Status.OPTIMAL


def test_exact_penalty_holds_a_soft_constraint_when_it_can():
    hard = pendulum(bounds={"torque": (-2.0, 2.0), "rate": (-0.3, 0.3)})
    soft = pendulum(bounds={"torque": (-2.0, 2.0), "rate": rumo.Bounds(-0.3, 0.3, rumo.Penalty(100.0))})
    plans = [rumo.RealTimeIteration(problem).step([0.0, 0.0], {"angle": 1.0}) for problem in (hard, soft)]
    assert [plan.status for plan in plans] == [Status.OPTIMAL, Status.OPTIMAL]
    assert plans[0].x["rate"].max() == pytest.approx(0.3)
    np.testing.assert_allclose(plans[1].u.values, plans[0].u.values, atol=1e-7)


def test_soft_constraint_out_of_reach_is_violated_and_says_where():
    soft = pendulum(bounds={"torque": (-2.0, 2.0), "rate": rumo.Bounds(-0.3, 0.3, rumo.Penalty(100.0))})
    plan = rumo.RealTimeIteration(soft).step([0.0, 2.0], {"angle": 0.0})
    assert plan.status is Status.SOFT_VIOLATED
    np.testing.assert_allclose(plan.slacks["rate_upper"], np.maximum(plan.x["rate"][1:] - 0.3, 0.0), atol=1e-7)
