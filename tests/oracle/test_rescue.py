"""Where an iteration is not to be trusted, the nonlinear program's solution takes its place, then and later."""

import time
from dataclasses import replace
from threading import Thread

import numpy as np
import pytest
from problems import pendulum, stiff_reactor, swinging_cart
from test_settling import HARD, apart, beside_the_path

import rumo
from rumo import Status

ENGINES = ["reference", "portable"]
EVERY_STEP = {"trusted_step": 0.0, "settling_iterations": 0}
"""No first iteration is trusted, and there is no other."""


def rescued(problem, scheme=None, nlp=None, **settings):
    """A controller all of whose steps are handed over, for as long as it takes."""
    rescue = rumo.DirectNlp(problem, scheme, **(nlp or {}))
    return rumo.RealTimeIteration(problem, scheme, rescue=rescue, **(EVERY_STEP | settings))


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("make", HARD.values(), ids=HARD)
def test_a_step_that_is_not_trusted_is_the_solution_of_the_nonlinear_program(make, engine):
    problem, x, reference = make()
    judged = rumo.RealTimeIteration(problem, settling_iterations=0, backend=engine)
    controller = rumo.RealTimeIteration(problem, settling_iterations=0, backend=engine, rescue=rumo.DirectNlp(problem))
    poor, plan = judged.step(x, reference), controller.step(x, reference)
    assert poor.status is Status.UNTRUSTED
    assert not poor.rescued
    assert plan.rescued
    assert plan.trusted
    assert controller.status_counts == {plan.status: 1}
    nlp = rumo.DirectNlp(problem)
    nlp.engage(applied=problem.safe_input, plan=poor)
    assert apart(problem, plan.u.values, nlp.step(x, reference).u.values) < 1e-6


@pytest.mark.parametrize("delay", [0, 1, 3])
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("scheme", [rumo.ImplicitEuler(), rumo.Radau2(substeps=2), rumo.Rk4()], ids=str)
def test_the_next_sample_starts_from_it(scheme, engine, delay):
    problem = pendulum(delay=delay, bounds={"torque": (-20.0, 20.0)})
    controller, nlp = rescued(problem, scheme, backend=engine), rumo.DirectNlp(problem, scheme)
    x, reference = np.array([0.8, 0.0]), {"angle": 0.5}
    for samples in (1, 2, 3, 4):
        before = controller.applied
        plan = controller.step(x, reference)
        assert plan.rescued
        assert apart(problem, plan.u.values, nlp.step(x, reference).u.values) < 1e-5
        np.testing.assert_array_equal(plan.u.values[:delay], before[:delay])
        np.testing.assert_array_equal(controller.applied[-1], plan.command.values)
        assert controller.status_counts.total() == samples
        x = plan.x.values[1]
    # IPOPT's trajectory satisfies the dynamics, and what the iteration starts from is that, one sample later.
    controller.configure(trusted_step=np.inf)
    after = controller.step(x, reference)
    assert not after.rescued
    assert after.diagnostics.integrator_residual < 1e-8
    lost = controller.step([np.nan, np.nan], reference)
    assert lost.status is Status.BAD_MEASUREMENT


@pytest.mark.parametrize("engine", ENGINES)
def test_a_stiff_model_goes_on_from_the_unknowns_within_its_intervals(engine):
    problem, x, reference = stiff_reactor()
    controller = rescued(problem, rumo.Radau3(), backend=engine)
    plan = controller.step(x, reference)
    assert plan.rescued
    controller.configure(trusted_step=np.inf)
    assert controller.step(plan.x.values[1], reference).diagnostics.integrator_residual < 1e-6


@pytest.mark.parametrize("engine", ENGINES)
def test_without_a_measurement_the_rescued_plan_is_followed(engine):
    controller = rescued(pendulum(), backend=engine)
    plan = controller.step([0.8, 0.0], {"angle": 0.5})
    for later in (1, 2, 3):
        lost = controller.step([np.nan, 0.0], {"angle": 0.5})
        assert lost.status is Status.BAD_MEASUREMENT
        assert not lost.rescued
        np.testing.assert_array_equal(lost.command.values, plan.u.values[1 + later])


@pytest.mark.parametrize("engine", ENGINES)
def test_a_reading_that_was_held_back_is_predicted_for_the_nonlinear_program_too(engine):
    problem, start, reference = swinging_cart()
    controller, x = rescued(problem, backend=engine), np.array(start)
    for _ in range(3):
        expected = controller.step(x, reference).x.values[1]
        x = expected.copy()
    plan = controller.step([expected[0] + 100.0, *expected[1:]], reference)
    assert plan.rescued
    assert [symptom.state for symptom in plan.health] == ["position"]
    np.testing.assert_allclose(plan.x.values[0], expected, atol=1e-9)


def turning(angle):
    """A body that a motor turns, slowly; its heading is measured as an angle, or with its turns."""
    model = rumo.Model(
        {"heading": "rad", "rate": "rad/s"},
        {"torque": "N"},
        lambda x, u, p: {"heading": x.rate, "rate": u.torque},
    )
    return rumo.Problem(
        model,
        horizon=20,
        sampling_time=0.1,
        track={"heading": rumo.Weight(1.0, range=1.0)},
        moves={"torque": rumo.Weight(0.01, range=2.0)},
        bounds={"torque": (-1.0, 1.0)},
        measurements={"heading": rumo.Measurement(angle=angle)},
    )


@pytest.mark.parametrize("engine", ENGINES)
def test_an_angle_goes_on_to_what_has_got_ahead_by_more_than_half_a_turn(engine):
    """As one whose turns are counted does."""
    wrapped, counted = (rescued(turning(angle), backend=engine) for angle in (True, False))
    x, handed_over = np.zeros(2), 0
    for k in range(40):
        wanted = min(0.5 * k, 8.0)
        expected = counted.step(x, {"heading": wanted})
        plan = wrapped.step([np.angle(np.exp(1j * x[0])), x[1]], {"heading": np.angle(np.exp(1j * wanted))})
        assert plan.trusted
        assert apart(wrapped.problem, plan.u.values, expected.u.values) < 1e-5
        handed_over += plan.rescued
        x = expected.x.values[1]
    assert handed_over > 10
    assert x[0] > 4.0


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("nlp", [{"max_iterations": 0}, {"max_wall_time": 1e-9}], ids=str)
def test_without_a_solution_the_step_is_what_it_was(nlp, engine):
    problem, x, reference = beside_the_path(9.0, 0.2)
    plain = rumo.RealTimeIteration(problem, backend=engine, **EVERY_STEP)
    controller = rescued(problem, nlp=nlp, backend=engine)
    for _ in range(3):
        expected, plan = plain.step(x, reference), controller.step(x, reference)
        assert plan.status is Status.UNTRUSTED
        assert not plan.rescued
        np.testing.assert_array_equal(plan.u.values, expected.u.values)
        np.testing.assert_array_equal(controller.applied, plain.applied)
    assert controller.status_counts == plain.status_counts


@pytest.mark.parametrize("engine", ENGINES)
def test_what_no_solver_can_do_stays_a_status(engine):
    impossible = {"late": rumo.Constraint(lambda x, u, p: 2.0 - x.angle)}  # hard, and out of reach
    controller = rescued(pendulum(constraints=impossible), backend=engine)
    plan = controller.step([0.0, 0.0], {"angle": 0.0})
    assert plan.cause is Status.SOLVER_FAILED
    assert plan.status is Status.PLAN_EXHAUSTED
    assert not plan.rescued
    assert np.isfinite(plan.command.values).all()


@pytest.mark.parametrize("engine", ENGINES)
def test_a_step_that_failed_is_rescued_from_the_state_alone(engine):
    problem, x, reference = swinging_cart()
    controller = rescued(problem, backend=engine, qp=rumo.QpOptions(max_iterations=0))
    plan = controller.step(x, reference)
    assert plan.rescued
    assert apart(problem, plan.u.values, rumo.DirectNlp(problem).step(x, reference).u.values) < 1e-5


def test_other_numbers_reach_the_nonlinear_program():
    problem, changes = pendulum(), {"weights": {"angle": 5.0}, "parameters": {"gravity": 3.0}}
    controller = rescued(problem)
    controller.update(**changes)
    plan = controller.step([0.8, 0.0], {"angle": 0.5})
    assert plan.rescued
    optimum = rumo.DirectNlp(problem.changed(**changes)).step([0.8, 0.0], {"angle": 0.5})
    assert apart(problem, plan.u.values, optimum.u.values) < 1e-5


def test_the_class_alone_is_enough_and_settings_stay_its_own():
    problem = pendulum()
    controller = rumo.RealTimeIteration(problem, rescue=rumo.DirectNlp, **EVERY_STEP)
    assert controller.step([0.8, 0.0], {"angle": 0.5}).rescued
    controller.configure(trusted_step=0.1, settling_iterations=10)
    assert not controller.step([0.8, 0.0], {"angle": 0.5}).rescued


def test_a_step_without_time_is_not_handed_over():
    controller = rescued(pendulum(), qp=rumo.QpOptions(time_limit=1e-9))
    plan = controller.step([0.8, 0.0], {"angle": 0.5})
    assert plan.cause is Status.BUDGET_EXCEEDED
    assert not plan.rescued


def test_a_rescue_ends_with_the_time_of_its_step():
    """However far IPOPT has come: it alone would take many times as long."""
    problem, x, reference = beside_the_path(9.0, 0.2)

    controller = rescued(problem)
    begin = time.perf_counter()
    assert controller.step(x, reference).rescued
    limit = 0.2 * (time.perf_counter() - begin)
    limited = rescued(problem, qp=rumo.QpOptions(time_limit=limit)).step(x, reference)
    assert limited.status is Status.UNTRUSTED
    assert not limited.rescued


def test_phases_explanation_and_times():
    controller = rescued(pendulum())
    controller.reset(x=[0.8, 0.0])
    with pytest.raises(rumo.CallOrderError):
        controller.feedback([0.8, 0.0], {"angle": 0.5})
    controller.prepare()
    plan = controller.feedback([0.8, 0.0], {"angle": 0.5})
    assert plan.rescued
    assert plan.timings.waited == plan.timings.feedback
    assert "Rescued: " in str(controller.explain(plan))
    assert "Rescued: " not in str(controller.explain(controller.step([np.nan, 0.0], {"angle": 0.5})))


@pytest.mark.parametrize(
    "call",
    [
        lambda controller: controller.reset(),
        lambda controller: controller.engage(applied=[0.0]),
        lambda controller: controller.prepare(),
        lambda controller: controller.applied,
        lambda controller: controller.status_counts,
    ],
    ids=["reset", "engage", "prepare", "applied", "status_counts"],
)
def test_other_threads_wait_for_the_rescue_of_a_step(call, monkeypatch):
    controller = rescued(pendulum())
    rescue, solve = controller._engine, controller._engine._nlp.step
    answers, threads = [], []

    def interrupted(x, reference):
        threads.append(Thread(target=lambda: answers.append(call(controller))))
        threads[0].start()
        threads[0].join(timeout=0.1)
        assert threads[0].is_alive()
        return solve(x, reference)

    monkeypatch.setattr(rescue._nlp, "step", interrupted)
    plan = controller.step([0.8, 0.0], {"angle": 0.5})
    assert plan.rescued
    threads[0].join(timeout=60.0)
    assert len(answers) == 1


def test_the_monitor_expects_what_follows_from_the_rescued_plan(monkeypatch):
    problem, start, reference = swinging_cart()
    controller, told = rescued(problem, backend="reference"), []
    guard = controller._engine.engine._guard
    monkeypatch.setattr(guard, "expect", told.append)
    plan = controller.step(start, reference)
    assert plan.rescued
    controller.prepare()
    u, x, inner = guard.plan
    np.testing.assert_array_equal(u, plan.u.values)
    np.testing.assert_array_equal(told[-1], controller.transcription.sensitivity(x[0], u[0], x[1], inner[0]))


def test_what_a_rescue_has_to_be():
    problem = pendulum()
    with pytest.raises(rumo.ArgumentError, match="rescue: got one of another problem"):
        rumo.RealTimeIteration(problem, rescue=rumo.DirectNlp(pendulum()))
    with pytest.raises(rumo.ArgumentError, match="rescue: got one with Radau2"):
        rumo.RealTimeIteration(problem, rescue=rumo.DirectNlp(problem, rumo.Radau2()))
    for wrong in (rumo.LinearTimeVarying, "nlp", True):
        with pytest.raises(rumo.ArgumentError, match=r"rescue: got .*, expected rumo\.DirectNlp"):
            rumo.RealTimeIteration(problem, rescue=wrong)
    with pytest.raises(rumo.ArgumentError, match="rescue: got a controller beside the loop in C"):
        rescued(problem).replay(np.zeros((1, 2)), np.zeros((1, 13, 1)), np.zeros((1, 1, 1)))


def test_a_log_tells_which_samples_were_rescued():
    problem = pendulum(bounds={"torque": (-20.0, 20.0)})
    run = rumo.Scenario(problem, problem.model, {"angle": 0.8, "rate": 0.0}, {"angle": 0.5}, 0.2)
    handed_over = {"rescue": rumo.DirectNlp(problem)} | EVERY_STEP
    log = replace(run, settings=handed_over).run()
    assert log["rescued"].dtype == bool
    assert log["rescued"].all()
    assert not run.run()["rescued"].any()
