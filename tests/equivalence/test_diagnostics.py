"""Diagnostics and iterations in the preparation: all backends alike, and what they are said to be."""

import numpy as np
import pytest
from problems import BACKENDS, EXACT, car, made_with, pendulum, reference_with
from test_backends import CASES, PENALTY, assert_same, drive

import rumo
from rumo.controllers.engines.conditions import Conditions, Point
from rumo.controllers.engines.guarded import Guarded
from rumo.controllers.engines.numpy import NumpyRti
from rumo.controllers.engines.qp import solve
from rumo.controllers.engines.stagewise import assemble, eliminate
from rumo.plan import DIAGNOSTICS
from rumo.transcription import Transcription

ITERATIONS = {
    "rti": {},
    "sqp": {"sqp_iterations": 3},
    "advanced": {"preparation_iterations": 2},
    "both": {"preparation_iterations": 1, "sqp_iterations": 2},
}


def numbers(plan):
    return np.array([getattr(plan.diagnostics, name) for name in DIAGNOSTICS])


@pytest.mark.parametrize("settings", ITERATIONS.values(), ids=ITERATIONS)
@pytest.mark.parametrize("name", CASES)
def test_portable_equals_reference(name, settings):
    problem, x, reference = CASES[name](16, 1, PENALTY)
    controllers = [
        rumo.RealTimeIteration(problem, rumo.Radau2(), qp=EXACT, backend=backend, **settings)
        for backend in ("reference", "portable")
    ]
    for first, second in drive(controllers, problem, x, reference):
        assert_same(problem, first, second, 1e-7)
        ours, theirs = ((d.integrator_residual, d.step, d.contraction) for d in (second.diagnostics, first.diagnostics))
        told = 2 if first.diagnostics.step < 1e-10 else 3  # a step of 1e-12 has no four digits to divide
        np.testing.assert_allclose(ours[:told], theirs[:told], rtol=1e-4, atol=1e-9)
        for plan in (first, second):
            assert not plan.status.solved or plan.diagnostics.kkt_residual < 1e-9
        assert first.diagnostics.integrated == second.diagnostics.integrated


def test_residual_is_the_newton_correction_of_the_guess():
    problem, x, window = car()
    transcription = Transcription(problem)
    method = NumpyRti(transcription, rumo.Settings())
    engine = Guarded(method, rumo.Settings())
    for _ in range(2):
        plan = engine.step(x, window)
    about = method.about
    stages = transcription.linearize(about.x, about.u, about.inner, problem.parameters)
    assert about.x is not plan.x.values
    correction = np.abs(eliminate(stages)[2][:-1]).max(axis=0)
    reach = assemble(stages, problem, transcription.imposed).reach
    expected = max(c / r for c, r in zip(correction, reach, strict=True) if r > 0.0)
    assert plan.diagnostics.integrator_residual == pytest.approx(expected)
    strict = rumo.RealTimeIteration(problem, integrator_tolerance=0.5 * expected)
    for _ in range(2):
        plan = strict.step(x, window)
    assert not plan.diagnostics.integrated


def test_a_linear_model_is_solved_in_one_step():
    problem = pendulum()
    controller = rumo.RealTimeIteration(problem, sqp_iterations=2, tolerance=0.0)
    diagnostics = controller.step([0.3, -0.2], {"angle": 0.1}).diagnostics
    assert diagnostics.step < 1e-12
    assert diagnostics.contraction < 1e-10
    assert diagnostics.kkt_residual < 1e-10


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("name", CASES)
def test_a_solution_has_no_kkt_residual(name, backend):
    problem, x, reference = CASES[name](16, 1, PENALTY)
    controller = made_with(problem, backend)
    for _ in range(3):
        plan = controller.step(x, reference)
        assert plan.status.solved
        assert plan.diagnostics.kkt_residual < 1e-11


def test_kkt_residual_of_inputs_is_their_reduced_gradient():
    """Of any inputs, with states that satisfy the dynamics and multipliers that balance all forces on states.

    By central differences of the cost along the linear model, one free input at a time.
    """
    programs, problem, x, target = [], pendulum(bounds={}), np.array([0.3, -0.2]), 0.4

    def optimize(program, options):
        programs.append(program)
        return solve(program, options)

    controller = reference_with(problem, optimize)
    plan = controller.step(x, {"angle": target})
    assert plan.diagnostics.step == pytest.approx(np.abs(plan.u.values[problem.delay :]).max() / 4.0)
    assert np.isnan(plan.diagnostics.contraction)

    def cost(u):
        state, total = x, 0.0
        for k in range(problem.horizon):
            state = controller.transcription.advance(state, u[k])[0][:2]
            total += problem.output_weights[k, 0] * (state[0] - target) ** 2
            move = u[k] - (u[k - 1] if k else 0.0)
            total += problem.move_weights[k, 0] * move[0] ** 2 if k >= problem.delay else 0.0
        return total

    # The guess is at rest with the safe input, 0.
    v, n = np.random.default_rng(0).normal(size=problem.horizon - problem.delay), problem.horizon - problem.delay
    u = np.r_[np.zeros(problem.delay), 4.0 * v][:, None]
    slopes = []
    for k in range(problem.delay, problem.horizon):
        change = np.zeros_like(u)
        change[k] = 1e-4
        slopes.append((cost(u + change) - cost(u - change)) / 2e-4 * problem.input_scales[0])
    conditions = Conditions(programs[0])
    H, g, E, e = conditions.H.toarray(), conditions.g, conditions.E.toarray(), conditions.e
    q = np.r_[v, np.linalg.solve(E[:, n:], e - E[:, :n] @ v)]
    y = np.linalg.solve(E[:, n:].T, -(H @ q + g)[n:])
    largest = (np.abs(H @ q + g) + np.abs(E.T) @ np.abs(y))[:n].max()
    expected = conditions.cost * np.abs(slopes).max() / largest
    assert conditions.residual(Point(q, y, np.zeros(0))) == pytest.approx(expected, rel=1e-6)


def test_unknown_without_a_solution():
    controller = rumo.RealTimeIteration(pendulum())
    controller.step([0.3, -0.2], {"angle": 0.1})
    plan = controller.step([np.nan, 0.0], {"angle": 0.1})
    assert np.isnan(numbers(plan)).all()
    assert not plan.diagnostics.integrated
    assert np.isnan(numbers(rumo.DirectNlp(pendulum()).step([0.3, -0.2], {"angle": 0.1}))).all()


def test_iterations_in_the_preparation_bring_the_plan_nearer_to_the_solution():
    """The reference stands still, so that all that a preparation assumes comes true, and what is left is Newton's."""
    problem, x, window = car()
    wanted = {name: np.full(problem.horizon + 1, values[0]) for name, values in window.items()} | {"p_x": 3.0}
    errors = {}
    for iterations in (0, 1, 3):
        controller = rumo.RealTimeIteration(problem, preparation_iterations=iterations, qp=EXACT)
        converged = rumo.RealTimeIteration(problem, sqp_iterations=50, tolerance=1e-12, qp=EXACT)
        state, worst = np.array(x), []
        for _ in range(4):
            converged.reset(applied=controller.applied)
            target, plan = converged.step(state, wanted), controller.step(state, wanted)
            worst.append(np.abs((plan.u.values - target.u.values) / problem.input_scales).max())
            state = controller.transcription.advance(state, plan.u.values[0])[0]
        errors[iterations] = max(worst[1:])
    assert errors[1] < 0.3 * errors[0]
    assert errors[3] < 0.1 * errors[1]


@pytest.mark.parametrize("backend", ["portable", "reference"])
@pytest.mark.parametrize("trouble", ["held back", "not finite", "not wanted"])
def test_a_preparation_expects_what_was_wanted_last(trouble, backend):
    """Whatever became of that sample: if all then is as expected, nothing is left to do."""
    controller = rumo.RealTimeIteration(pendulum(), preparation_iterations=1, qp=EXACT, backend=backend)
    x = controller.step([0.1, 0.0], {"angle": 0.1}).x.values[1]
    controller.configure(preparation_iterations=0 if trouble == "not wanted" else 1)
    plan = controller.step({"held back": [1e6, 0.0], "not finite": [np.nan, 0.0]}.get(trouble, x), {"angle": -0.1})
    controller.configure(preparation_iterations=1)
    assert controller.step(plan.x.values[1], {"angle": -0.1}).diagnostics.step < 1e-9
