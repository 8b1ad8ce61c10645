"""A step that is safeguarded: where it is trusted it is near what IPOPT comes to, and it costs nothing elsewhere."""

import numpy as np
import pytest
from problems import car, cooled_reactor, pendulum, swinging_cart, tank

import rumo
from rumo import Status
from rumo.simulation import Plant
from rumo.studies.linearization import BASE
from rumo.textbook import cart_pendulum

ENGINES = ["reference", "portable"]


def beside_the_path(error, heading, speed=8.0):
    """The case study's car, that far from a straight path and pointing away from it: problem, state, reference."""
    problem = BASE.problem()
    ahead = speed * problem.sampling_time * np.arange(problem.horizon + 1)
    x = [{"v_x": speed, "p_y": error, "psi": heading}.get(name, 0.0) for name in problem.model.states]
    return problem, np.array(x), {name: {"p_x": ahead, "v_x": speed}.get(name, 0.0) for name in problem.outputs}


def swing_up():
    """A cart with a pendulum that hangs down and is wanted upright; the force is too weak to do it at once."""
    problem, _, reference = swinging_cart()
    return problem, np.array([0.0, 0.0, np.pi - 0.4, 0.0]), reference


def around_an_obstacle():
    """A point that has to get past a disk, on whose far side it is wanted."""
    model = rumo.Model(
        states={"x": "m", "y": "m", "v_x": "m/s", "v_y": "m/s"},
        inputs={"a_x": "m/s^2", "a_y": "m/s^2"},
        dynamics=lambda x, u, p: {"x": x.v_x, "y": x.v_y, "v_x": u.a_x, "v_y": u.a_y},
    )
    problem = rumo.Problem(
        model,
        horizon=20,
        sampling_time=0.2,
        track={"x": rumo.Weight(1.0), "y": rumo.Weight(1.0)},
        moves={"a_x": rumo.Weight(0.1), "a_y": rumo.Weight(0.1)},
        bounds={"a_x": (-2.0, 2.0), "a_y": (-2.0, 2.0)},
        constraints={
            "disk": rumo.Constraint(
                lambda x, u, p: 1.0 - (x.x - 2.0) ** 2 - (x.y - 0.1) ** 2, penalty=rumo.Penalty(100.0)
            )
        },
    )
    return problem, np.zeros(4), {"x": 4.0, "y": 0.0}


HARD = {
    "5 m beside": lambda: beside_the_path(5.0, 0.4),
    "9 m beside": lambda: beside_the_path(-9.0, -0.2),
    "1.2 rad": lambda: beside_the_path(0.0, 1.2),
    "fast": lambda: beside_the_path(2.0, -0.7, 18.0),
    "swing-up": swing_up,
    "obstacle": around_an_obstacle,
}


def apart(problem, u, other):
    """Largest distance of inputs over their ranges."""
    return np.abs((u - other) / problem.input_scales).max()


def converging(problem):
    """A controller that iterates until nothing changes."""
    return rumo.RealTimeIteration(problem, gate=None, sqp_iterations=300, tolerance=1e-10, backend="portable")


def error_of(plan, iterating, applied, x, reference):
    """How far a plan's command is from the one that iterations from the plan itself come to."""
    iterating.engage(applied=applied, plan=plan)
    d, optimum = iterating.problem.delay, iterating.step(x, reference)
    return apart(iterating.problem, plan.u.values[d], optimum.u.values[d])


@pytest.mark.parametrize("make", HARD.values(), ids=HARD)
def test_many_iterations_are_a_globally_convergent_sqp(make):
    """The same optimum as IPOPT's; the plain iteration, with full steps, does not come to it."""
    problem, x, reference = make()
    options = {"gate": None, "sqp_iterations": 300, "tolerance": 1e-10, "backend": "portable"}
    plan = rumo.RealTimeIteration(problem, **options).step(x, reference)
    nlp = rumo.DirectNlp(problem, gate=None, tolerance=1e-10, max_iterations=2000)
    nlp.engage(applied=problem.safe_input, plan=plan)
    optimum = nlp.step(x, reference)
    assert plan.status.solved
    assert optimum.status.solved
    assert apart(problem, plan.u.values, optimum.u.values) < 1e-5


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("make", HARD.values(), ids=HARD)
def test_a_cold_start_settles_near_the_optimum(make, engine):
    problem, x, reference = make()
    plan = rumo.RealTimeIteration(problem, gate=None, backend=engine).step(x, reference)
    optimum = converging(problem).step(x, reference)
    assert plan.trusted
    assert apart(problem, plan.u.values[problem.delay], optimum.u.values[problem.delay]) < 0.05


@pytest.mark.parametrize("make", HARD.values(), ids=HARD)
def test_without_iterations_to_settle_it_says_that_it_has_not(make):
    problem, x, reference = make()
    judged = rumo.RealTimeIteration(problem, gate=None, settling_iterations=0).step(x, reference)
    assert judged.status is judged.cause is Status.UNTRUSTED
    assert not judged.trusted
    assert np.isfinite(judged.u.values).all()


@pytest.mark.parametrize("engine", ENGINES)
def test_engines_settle_alike(engine):
    rng = np.random.default_rng(1)
    problem, _, _ = beside_the_path(0.0, 0.0)
    for _ in range(3):
        _, x, reference = beside_the_path(rng.uniform(-3.0, 3.0), rng.uniform(-0.5, 0.5))
        plans = [
            rumo.RealTimeIteration(problem, gate=None, backend=backend).step(x, reference)
            for backend in ("tailored", engine)
        ]
        assert plans[0].status is plans[1].status
        assert apart(problem, plans[0].u.values, plans[1].u.values) < 1e-6
        for name in ("step", "command_error"):
            values = [getattr(plan.diagnostics, name) for plan in plans]
            np.testing.assert_allclose(values[0], values[1], rtol=1e-4, atol=1e-9)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("make", [car, pendulum], ids=["car", "pendulum"])
def test_a_step_that_is_trusted_is_the_plain_one(make, engine):
    made = make()
    problem, x, reference = made if isinstance(made, tuple) else (made, np.array([0.1, 0.0]), {"angle": 0.1})
    start = rumo.RealTimeIteration(problem, sqp_iterations=20, backend=engine).step(x, reference)
    plans = []
    for settings in ({}, {"trusted_step": np.inf}):
        controller = rumo.RealTimeIteration(problem, backend=engine, **settings)
        controller.engage(applied=problem.safe_input, plan=start)
        plans.append(controller.step(x, reference))
    assert plans[0].diagnostics.step < 0.1
    assert np.isnan(plans[0].diagnostics.command_error)
    np.testing.assert_array_equal(plans[0].u.values, plans[1].u.values)
    np.testing.assert_array_equal(plans[0].x.values, plans[1].x.values)


def test_the_error_of_the_command_is_an_estimate_that_holds():
    """Against convergence, from guesses that the measurement has left: how much of it the estimate covers."""
    rng, covered, told = np.random.default_rng(2), 0, 0
    problem, _, _ = beside_the_path(0.0, 0.0)
    settling = rumo.RealTimeIteration(problem, gate=None, backend="portable")
    iterating = converging(problem)
    for _ in range(150):
        _, x, reference = beside_the_path(rng.uniform(-4.0, 4.0), rng.uniform(-0.6, 0.6))
        settling.reset()
        plan = settling.step(x, reference)
        if not np.isfinite(plan.diagnostics.command_error):
            continue
        error = error_of(plan, iterating, np.zeros((1, 2)), x, reference)
        told += 1
        covered += error <= plan.diagnostics.command_error
    assert told > 100
    assert covered >= 0.99 * told


@pytest.mark.parametrize(("engine", "samples"), [("reference", 6), ("portable", 25)])
def test_guesses_that_stray_are_repaired_also_after_others_that_did(engine, samples):
    """Each sample is metres and half a radian from the one before; most settle, and those that do are right."""
    rng = np.random.default_rng(5)
    problem, _, _ = beside_the_path(0.0, 0.0)
    controller = rumo.RealTimeIteration(problem, gate=None, backend=engine)
    iterating = converging(problem)
    errors = []
    for _ in range(samples):
        _, x, reference = beside_the_path(rng.uniform(-6.0, 6.0), rng.uniform(-1.0, 1.0), rng.uniform(4.0, 14.0))
        applied = controller.applied
        plan = controller.step(x, reference)
        assert plan.status.applicable
        if plan.trusted:
            errors.append(error_of(plan, iterating, applied, x, reference))
    assert len(errors) > 0.6 * samples
    assert max(errors) < 0.05


@pytest.mark.parametrize("engine", ENGINES)
def test_where_no_cut_step_leads_on_a_damped_one_does(engine):
    """The tank is fuller than planned; from the old plan every share of the step leads to negative levels."""
    controller = rumo.RealTimeIteration(tank(), gate=None, backend=engine)
    for level in (1.0, 0.4, 0.1, 0.02):
        controller.step([level], {"level": 0.02})
    applied = controller.applied
    plan = controller.step([1.0], {"level": 0.02})
    assert plan.trusted
    assert error_of(plan, converging(tank()), applied, [1.0], {"level": 0.02}) < 1e-6


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("make", HARD.values(), ids=HARD)
def test_a_guess_that_is_out_of_bounds_by_now_is_no_measure_of_a_plan(make, engine):
    """Inputs of the old plan are worth more than bounds allow, which have become narrower since."""
    problem, x, reference = make()
    start = rumo.RealTimeIteration(problem, gate=None, backend="portable").step(x, reference)
    bounds = problem.numbers.input_upper[-1]
    narrower = {name: (-0.3 * most, 0.3 * most) for name, most in zip(problem.model.inputs, bounds, strict=True)}
    controller = rumo.RealTimeIteration(problem, gate=None, backend=engine)
    controller.engage(applied=problem.safe_input, plan=start)
    controller.update(bounds=narrower)
    x = x + np.where(np.arange(len(x)) < 3, 0.3, 0.0)
    plan = controller.step(x, reference)
    assert plan.trusted
    assert error_of(plan, converging(problem.changed(bounds=narrower)), problem.safe_input, x, reference) < 0.05
    assert (np.abs(plan.u.values[problem.delay :]) <= 0.3 * bounds * (1.0 + 1e-9)).all()
    assert (np.abs(start.u.values[problem.delay :]) > 0.3 * bounds).any()


@pytest.mark.parametrize("engine", ENGINES)
def test_a_tiny_step_after_a_large_one_settles_nothing(engine):
    """The second step moves no input away from its bound, the third does, by all of its range in the end."""
    problem, x, reference = cooled_reactor()
    controller = rumo.RealTimeIteration(problem, gate=None, backend=engine)
    for _ in range(30):
        x = controller.step(x, reference).x.values[1]
    applied = controller.applied
    jumped = [2.46521, 0.66446, 80.5747, 86.4267]
    plan = controller.step(jumped, reference)
    assert plan.status.applicable
    assert error_of(plan, converging(problem), applied, jumped, reference) < 0.05 or not plan.trusted


def test_a_curved_limit_that_full_steps_go_around():
    """The curvature of a limit is no part of the Gauss-Newton Hessian: full steps swing about the optimum for ever."""
    model = rumo.Model(
        states={"x": "1", "y": "1"},
        inputs={"u": "1/s", "v": "1/s"},
        dynamics=lambda x, u, p: {"x": u.u, "y": u.v},
    )
    problem = rumo.Problem(
        model,
        horizon=1,
        sampling_time=1.0,
        track={"x": rumo.Weight(1.0), "y": rumo.Weight(1.0)},
        moves={"u": rumo.Weight(1e-6), "v": rumo.Weight(1e-6)},
        bounds={"u": (-3.0, 3.0), "v": (-3.0, 3.0)},
        constraints={"circle": rumo.Constraint(lambda x, u, p: x.x**2 + x.y**2, limit=1.0)},
    )
    x = np.array([np.cos(0.8), np.sin(0.8)])
    heights = []
    for settings in ({}, {"trusted_step": np.inf}):
        rti = rumo.RealTimeIteration(problem, gate=None, sqp_iterations=40, tolerance=1e-7, **settings)
        rti.engage(applied=[0.0, 0.0], plan={"x": [x, x], "u": [[0.0, 0.0]]})
        heights.append(rti.step(x, {"x": 2.0, "y": 0.0}).x.values[1])
    np.testing.assert_allclose(heights[0], [1.0, 0.0], atol=1e-5)
    assert abs(heights[1][1]) > 0.03


def test_what_settling_needs():
    for name, value in (("settling_iterations", -1), ("trusted_step", -0.1), ("trusted_step", np.nan)):
        with pytest.raises(rumo.ArgumentError, match=name):
            rumo.RealTimeIteration(pendulum(), **{name: value})


@pytest.mark.parametrize("engine", ENGINES)
def test_states_have_settled_too_where_all_inputs_are_at_their_bounds(engine):
    """A push turns a pendulum over: no input changes any more, but what is linearised leads to 80 000 rad/s."""
    problem = rumo.Problem(
        cart_pendulum(),
        horizon=40,
        sampling_time=0.05,
        track={"position": rumo.Weight(1.0), "angle": rumo.Weight(1.0, range=0.5)},
        moves={"force": rumo.Weight(0.1, range=20.0)},
        bounds={"force": (-10.0, 10.0)},
    )
    h, f, p = problem.sampling_time, problem.model.f, problem.parameters[0]
    plant = Plant(cart_pendulum(), h)
    controller = rumo.RealTimeIteration(problem, backend=engine)
    x = np.array([0.02, 0.0, -2.4, 1.0])
    for k in range(21):
        x = x + (np.array([0.0, 1.0, 0.0, 5.0]) if k == 20 else 0.0)
        plan = controller.step(x, {"position": 0.0, "angle": 0.0})
        x = plant.advance(x, plan.command.values, p)
        lacking = [
            np.abs(after - before - h * np.array(f(after, u, p), dtype=float).ravel()).max()
            for before, after, u in zip(plan.x.values[:-1], plan.x.values[1:], plan.u.values, strict=True)
        ]
        assert not plan.trusted or max(lacking) < 0.1
