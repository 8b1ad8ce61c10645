"""Open-loop unstable plants over long horizons: a plan called solved is right, and the reference solves them all.

Condensed, the QP loses as many digits as the square of the plant's growth over the horizon has.
"""

import dataclasses
import json
from fractions import Fraction
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from problems import BACKENDS, advanced, balanced_cart, made_with
from scipy.sparse import block_array, csc_array, diags_array, eye_array, kron
from scipy.sparse.linalg import spsolve

import rumo
from rumo.controllers import NlpSettings
from rumo.controllers.engines.stagewise import eliminate
from rumo.studies.linearization import BASE
from rumo.textbook import cart_pendulum
from rumo.transcription import Transcription

RIGHT = 1e-6  # of an input's range
ROUNDING = 1e-12  # of slopes, relative to the largest, which are sums of much larger numbers
LENGTH = 1.0  # of the horizon [s]
PLANTS = {
    "pole": [[1.0]],
    "pair": [[1.0, 2.0], [-2.0, 1.0]],
    "two poles": [[1.0, 0.3], [0.0, 0.4]],
    "unstable and stable": [[1.0, 0.0], [0.5, -2.0]],
}
GROWTHS = (1, 5, 10, 15, 20)


def cases(*values):
    """With every backend."""
    return [(backend, *value) for backend in BACKENDS for value in values]


def assert_true(plan, expected, backend):
    """Right, or not called solved; only where states are condensed there is an excuse."""
    if backend != "condensing":
        assert plan.status.solved
    if plan.status.solved:
        wrong = np.abs(plan.u.values - expected) / plan.problem.input_scales
        assert wrong.max() < RIGHT


def linear(plant, horizon, growth, **changes):
    """A linear plant whose fastest mode grows by e^growth over the horizon, exactly so for explicit Euler."""
    F, dt = np.array(PLANTS[plant]), LENGTH / horizon
    # |1 + rate lambda dt|^horizon = e^growth
    modes = np.linalg.eigvals(F)
    mode = modes[np.argmax(modes.real)]
    a, b, c = np.abs(mode) ** 2, 2.0 * mode.real, 1.0 - np.exp(2.0 * growth / horizon)
    rate = (-b + np.sqrt(b**2 - 4.0 * a * c)) / (2.0 * a) / dt
    F, names = rate * F, [f"x{i}" for i in range(len(F))]
    model = rumo.Model(
        states=dict.fromkeys(names, "1"),
        inputs={"u": "1"},
        dynamics=lambda x, u, p: {
            row: sum(F[i, j] * x[column] for j, column in enumerate(names)) + rate * (1.0 + i) * u.u
            for i, row in enumerate(names)
        },
    )
    settings = {
        "track": {name: rumo.Weight(1.0, range=0.5) for name in names},
        "moves": {"u": rumo.Weight(0.01, range=2.0)},
    }
    problem = rumo.Problem(model, horizon=horizon, sampling_time=dt, **(settings | changes))
    return problem, np.eye(len(F)) + dt * F, dt * rate * np.arange(1.0, len(F) + 1.0)[:, None]


def minimiser(problem, A, B, x, target):
    """Inputs without limits, by the sparse optimality conditions in x_1 ... x_N, u_0 ... u_{N-1}."""
    N, nx = problem.horizon, len(A)
    below = diags_array(np.ones(N - 1), offsets=-1, shape=(N, N))
    E = block_array([[eye_array(N * nx) - kron(below, A), -kron(eye_array(N), B)]])
    difference = eye_array(N) - below
    Q = diags_array(2.0 * problem.output_weights.ravel())
    R = difference.T @ diags_array(2.0 * problem.move_weights.ravel()) @ difference
    H = block_array([[Q, None], [None, R]])
    slope, ends = np.zeros(N * (nx + 1)), np.zeros(N * nx)
    slope[: N * nx] = -Q @ np.tile(target, N)
    ends[:nx] = A @ x
    solution = spsolve(csc_array(block_array([[H, E.T], [E, None]])), np.r_[-slope, ends])
    return solution[N * nx :][:N][:, None]


@pytest.mark.parametrize(
    ("backend", "plant", "horizon", "growth"),
    cases(*((plant, N, growth) for plant in PLANTS for N in (10, 47, 150, 500) for growth in GROWTHS)),
)
def test_without_limits(backend, plant, horizon, growth):
    problem, A, B = linear(plant, horizon, growth)
    x, target = np.linspace(0.1, -0.05, len(A)), np.linspace(0.3, 0.2, len(A))
    controller = made_with(problem, backend, rumo.ExplicitEuler())
    plan = controller.step(x, dict(zip(problem.outputs, target, strict=True)))
    assert_true(plan, minimiser(problem, A, B, x, target), backend)


LIMITS = {
    "inputs": {"bounds": {"u": (-0.4, 0.4)}},
    "moves": {"bounds": {"u": (-0.4, 0.4)}, "move_bounds": {"u": (-0.15, 0.15)}},
    "hard": {"bounds": {"u": (-0.4, 0.4), "x0": (-1.0, 0.25)}},
    "soft": {"bounds": {"u": (-0.4, 0.4), "x0": rumo.Bounds(-1.0, 0.25, rumo.Penalty(1.0, 10.0))}},
    "exceeded": {"bounds": {"u": (-0.4, 0.4), "x0": rumo.Bounds(-1.0, 0.25, rumo.Penalty(1e-3))}},
}


LIMITED = [("pole", 20, 5), ("two poles", 60, 10), ("pole", 100, 15), ("pole", 150, 20), ("pair", 60, 20)]


@cache
def at_limits(limits, plant, horizon, growth):
    """Problem, state, what is wanted, and IPOPT's plan."""
    problem, A, _ = linear(plant, horizon, growth, delay=1, **LIMITS[limits])
    x, wanted = np.linspace(0.02, -0.01, len(A)), dict(zip(problem.outputs, [0.3, 0.1], strict=False))
    return problem, x, wanted, converged(problem, rumo.ExplicitEuler(), x, wanted)


def converged(problem, scheme, x, wanted):
    settings = NlpSettings(tolerance=1e-11, max_iterations=1000)
    plan = rumo.DirectNlp(problem, scheme, settings=settings).step(x, wanted)
    assert plan.status.solved
    return plan


@pytest.mark.parametrize(
    ("backend", "limits", "plant", "horizon", "growth"), cases(*((name, *case) for name in LIMITS for case in LIMITED))
)
def test_at_limits(backend, limits, plant, horizon, growth):
    problem, x, wanted, oracle = at_limits(limits, plant, horizon, growth)
    plan = made_with(problem, backend, rumo.ExplicitEuler()).step(x, wanted)
    assert_true(plan, oracle.u.values, backend)
    if plan.status.solved:
        assert plan.status is oracle.status


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(
    ("plant", "horizon", "growth"), [("pair", 60, 18), ("two poles", 60, 18), ("unstable and stable", 100, 18)]
)
def test_bounds_hold_as_exactly_late_as_early(plant, horizon, growth, backend):
    """The first inputs do e^growth times as much to the last states, but earlier states are at their bounds as well."""
    bound = rumo.Bounds(-0.04, 0.01, rumo.Penalty(10.0, 1.0))
    changes = {"moves": {"u": rumo.Weight(100.0, range=2.0)}, "bounds": {"x0": bound}}
    problem, _, _ = linear(plant, horizon, growth, delay=1, **changes)
    x, wanted = [0.02, -0.01], {"x0": -0.8, "x1": 0.3}
    oracle = converged(problem, rumo.ExplicitEuler(), x, wanted)
    controller = made_with(problem, backend, rumo.ExplicitEuler(), gate=None)
    tolerance = rumo.QpOptions().tolerance  # not as fine as elsewhere in tests
    controller.configure(qp=dataclasses.replace(controller.settings.qp, tolerance=tolerance))
    plan = controller.step(x, wanted)
    assert plan.status is oracle.status is rumo.Status.OPTIMAL
    np.testing.assert_allclose(plan.u.values, oracle.u.values, atol=RIGHT)


@pytest.mark.usefixtures("kept_builds")
@pytest.mark.filterwarnings("ignore::rumo.UnstableModeWarning")  # rightly
@pytest.mark.parametrize(
    ("backend", "scheme", "pole"),
    [
        *cases((rumo.ImplicitEuler(), 10.0), (rumo.ImplicitMidpoint(), 20.0)),
        pytest.param("tailored", rumo.ImplicitEuler(), 10.0, marks=pytest.mark.slow),
        pytest.param("tailored", rumo.ImplicitMidpoint(), 20.0, marks=pytest.mark.slow),
    ],
)
def test_a_scheme_next_to_its_own_pole_solves_nothing(backend, scheme, pole):
    """An interval multiplies the state by 1e9, and with it the rounding of all that is known of it."""
    model = rumo.Model(
        states={"x": "1"}, inputs={"u": "1"}, dynamics=lambda x, u, p: {"x": pole * (1.0 - 1e-9) * x.x + u.u}
    )
    problem = rumo.Problem(
        model,
        horizon=10,
        sampling_time=0.1,
        track={"x": rumo.Weight(1.0)},
        moves={"u": rumo.Weight(0.01, range=2.0)},
        bounds={"u": (-1.0, 1.0)},
    )
    plan = made_with(problem, backend, scheme, gate=None).step([0.1], {"x": 0.3})
    assert plan.cause is rumo.Status.ILL_CONDITIONED


def test_the_last_interval_may_multiply_by_more():
    """Nothing follows it: by e^19 here, and the minimum of a quadratic in one input is known."""
    model = rumo.Model(states={"x": "1"}, inputs={"u": "1"}, dynamics=lambda x, u, p: {"x": 19.0 * x.x + u.u})
    problem = rumo.Problem(
        model, horizon=1, sampling_time=1.0, track={"x": rumo.Weight(1.0)}, moves={"u": rumo.Weight(0.01, range=2.0)}
    )
    plan = made_with(problem, "riccati", rumo.Rk4(200), gate=None).step([1e-3], {"x": 0.0})
    assert plan.status is rumo.Status.OPTIMAL
    # x = e^19 x_0 + (e^19 - 1) / 19 u, and next to that what u costs is nothing
    assert plan.command["u"] == pytest.approx(-19e-3, rel=1e-6)


RUNAWAY = rumo.Bounds(-0.03, 0.03, rumo.Penalty(1e-3, 1.0))
"""Of states far beyond it: nearly all of these rows give way, and nearly all inputs are at bounds."""


def runaway(horizon, growth):
    return linear("pair", horizon, growth, delay=1, bounds={"u": (-0.4, 0.4), "x0": RUNAWAY, "x1": RUNAWAY})[0]


@pytest.mark.parametrize("solver", ["riccati", "condensing"])
def test_many_rows_that_give_way_take_long(solver):
    """A budget that is too small is all that is wrong; one that is not leads to IPOPT's plan."""
    problem, x, wanted = runaway(100, 5), [0.5, -0.3], {"x0": -0.3, "x1": 0.3}
    budgets = {"riccati": 1100, "condensing": 700}
    plans = []
    for iterations in (budgets[solver], 5000):
        qp = rumo.QpOptions(max_iterations=iterations, solver=solver)
        controller = rumo.RealTimeIteration(problem, rumo.ExplicitEuler(), qp=qp, backend="portable")
        plans.append(controller.step(x, wanted))
    oracle = converged(problem, rumo.ExplicitEuler(), x, wanted)
    assert [plan.status for plan in plans] == [rumo.Status.BUDGET_EXCEEDED, oracle.status]
    np.testing.assert_allclose(plans[1].u.values, oracle.u.values, atol=RIGHT)


@pytest.mark.parametrize("solver", ["riccati", "condensing"])
@pytest.mark.parametrize(("horizon", "growth"), [(100, 5), (300, 3)])
def test_the_budget_of_iterations_grows_with_the_rows(solver, horizon, growth):
    """As it comes, it is enough where most rows join, and some leave again."""
    qp = rumo.QpOptions(solver=solver)
    controller = rumo.RealTimeIteration(
        runaway(horizon, growth), rumo.ExplicitEuler(), qp=qp, backend="portable", gate=None
    )
    plan = controller.step([0.5, -0.3], {"x0": -0.3, "x1": 0.3})
    assert plan.status is rumo.Status.SOFT_VIOLATED
    assert plan.iterations > (1000 if solver == "riccati" or horizon > 100 else 700)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(
    "problem",
    [
        runaway(20, 15),
        linear("pole", 12, 35, bounds={"u": (-1.0, 1.0)})[0],
        linear("pair", 12, 25, bounds={"u": (-1.0, 1.0)}, move_bounds={"u": (-0.1, 0.1)})[0],
    ],
    ids=["soft", "inputs", "moves"],
)
def test_what_inputs_alone_can_keep_is_never_impossible(problem, backend):
    """However huge states are; that it cannot be solved may be said, but no more."""
    x, wanted = [0.5, -0.3][: len(problem.outputs)], dict(zip(problem.outputs, [-0.3, 0.3], strict=False))
    plan = made_with(problem, backend, rumo.ExplicitEuler(), gate=None).step(x, wanted)
    assert plan.status.applicable or plan.cause is rumo.Status.ILL_CONDITIONED


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["reference", "riccati"])
@pytest.mark.parametrize("limits", LIMITS)
def test_at_limits_over_a_long_horizon(limits, backend):
    """IPOPT's barrier leaves inputs near a limit 1e-5 away from it; the command is known to all digits."""
    problem, x, wanted, oracle = at_limits(limits, "pole", 500, 20)
    plan = made_with(problem, backend, rumo.ExplicitEuler()).step(x, wanted)
    assert plan.status is oracle.status
    assert plan.command["u"] == pytest.approx(oracle.command["u"], abs=RIGHT)
    np.testing.assert_allclose(plan.u.values, oracle.u.values, atol=1e-4)


CARTS = {
    "free": {},
    "force": {"force": (-1.0, 1.0)},
    "hard": {"force": (-3.0, 3.0), "speed": (-0.3, 0.3)},
    "soft": {"force": (-3.0, 3.0), "speed": rumo.Bounds(-0.12, 0.12, rumo.Penalty(0.01))},
}


@cache
def cart_at_limits(limits, horizon):
    problem, x, wanted = balanced_cart(horizon, **CARTS[limits]), [0.2, 0.0, 0.05, 0.0], {"position": 0.0, "angle": 0.0}
    return problem, x, wanted, converged(problem, None, x, wanted)


@pytest.mark.parametrize(
    # The pendulum falls by a factor of e in 0.22 s.
    ("backend", "limits", "horizon", "growth"),
    cases(("soft", 40, 9), ("hard", 60, 13), ("force", 80, 18), ("free", 100, 22)),
)
def test_a_pendulum_on_a_cart(backend, limits, horizon, growth):
    problem, x, wanted, oracle = cart_at_limits(limits, horizon)
    controller = made_with(problem, backend, sqp_iterations=50, tolerance=1e-10)
    assert_true(controller.step(x, wanted), oracle.u.values, backend)


@pytest.mark.parametrize(
    ("backend", "horizon", "seconds", "near"),
    [
        ("reference", 60, 4.0, 0.1),
        *(pytest.param("reference", N, 10.0, 0.02, marks=pytest.mark.slow) for N in (60, 80, 100)),
        *(("riccati", N, 10.0, 0.02) for N in (60, 80, 100)),
    ],
)
def test_it_swings_up_and_balances(backend, horizon, seconds, near):
    """In closed loop, from hanging at rest, over horizons of 3 to 5 s."""
    problem = rumo.Problem(
        cart_pendulum(),
        horizon=horizon,
        sampling_time=0.05,
        track={
            "position": rumo.Weight(0.1),
            "speed": rumo.Weight(0.01),
            "angle": rumo.Weight(1.0),
            "rate": rumo.Weight(0.01),
        },
        moves={"force": rumo.Weight(0.1, range=20.0)},
        bounds={"force": (-10.0, 10.0)},
    )
    controller = made_with(problem, backend, rumo.Gauss2())
    x = np.array([0.0, 0.0, np.pi, 0.0])
    for _ in range(round(seconds / problem.sampling_time)):
        plan = controller.step(x, dict.fromkeys(problem.outputs, 0.0))
        assert plan.status.solved
        x = advanced(controller, x, plan.command.values)
    assert np.abs(x[[2, 3]]).max() < near  # rad, rad/s


WILD = json.loads(Path(__file__).with_name("wild_guesses.json").read_text(encoding="utf-8"))
"""Samples of the paper's car in a spin, with guesses whose linearisation grows by 1e12 and more over the horizon."""


def exact(array):
    """Rational numbers, in which nothing is rounded."""
    return np.vectorize(Fraction)(np.asarray(array))


def slopes_by_inputs(problem, guess_x, guess_u, x, wanted, before, u):
    """Slopes of the linearised problem's cost by inputs in units of their ranges (N, nu), and its hard constraints.

    With what soft constraints cost that are exceeded; none of them is at its limit. In exact arithmetic.
    """
    transcription, N, l1 = Transcription(problem), problem.horizon, problem.numbers.l1
    inner = transcription.inner_between(guess_x[:-1], guess_x[1:])
    stages = transcription.linearize(guess_x, guess_u, inner, problem.parameters)
    A, B, c = (exact(array) for array in eliminate(stages))
    Cx, D, wanted, scale = exact(stages.Cx), exact(stages.D), exact(wanted), exact(problem.input_scales)
    assert not stages.Cu.any()
    assert not stages.E.any()
    u = exact(u)
    du, dx, slope_x, constraints = u - exact(guess_u), exact(x) - exact(guess_x[0]), [], []
    for k in range(N):
        dx = A[k] @ dx + B[k] @ du[k] + c[k]
        errors = exact(stages.y[k]) + Cx[k] @ dx - wanted[k + 1]
        constraints.append(exact(stages.G[k]) + D[k] @ dx)
        exceeded = (l1 < np.inf) & (constraints[-1] > 0) & transcription.imposed[k]
        price = exact(np.where(exceeded, l1, 0.0))
        slope_x.append(Cx[k].T @ (2 * exact(problem.output_weights[k]) * errors) + D[k].T @ price)
    weight = 2 * exact(problem.move_weights[problem.delay :])
    force = weight * np.diff(np.vstack([exact(before)[None], u[problem.delay :]]), axis=0)
    slope, adjoint = [], 0 * dx
    for k in reversed(range(N)):
        adjoint = adjoint + slope_x[k]
        if k >= problem.delay:
            i = k - problem.delay
            slope.append(scale * (B[k].T @ adjoint + force[i] - (force[i + 1] if i + 1 < len(force) else 0)))
        adjoint = A[k].T @ adjoint
    hard = np.array(constraints)[problem.delay :][:, l1 == np.inf]
    return np.array(slope[::-1]).astype(float), hard.astype(float)


@pytest.mark.usefixtures("kept_builds")
@pytest.mark.parametrize("backend", ["riccati", pytest.param("tailored", marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", WILD)
def test_guesses_beyond_all_measure(name, backend):
    """Nearly all inputs of a runaway plant are at bounds; slopes in exact arithmetic say that they belong there."""
    case = {key: np.array(value) for key, value in WILD[name].items()}
    problem = BASE.problem()
    N, d = problem.horizon, problem.delay
    x, u = (np.broadcast_to(case[key], (n, case[key].shape[1])) for key, n in (("guess_x", N + 1), ("guess_u", N)))
    controller = made_with(problem, backend, gate=None)
    # How many changes it takes hangs on rounding, and so on CasADi's version.
    controller.configure(qp=dataclasses.replace(controller.settings.qp, max_iterations=10_000))
    controller.engage(applied=case["applied"], x=case["x"], plan={"x": x, "u": u})
    plan = controller.step(case["x"], case["reference"])
    assert plan.status.solved
    given = np.array(x, dtype=float), np.array(u, dtype=float), case["x"], case["reference"], case["applied"]
    slope, hard = slopes_by_inputs(problem, *given, plan.u.values)
    u, low, high = (array[d:] for array in (plan.u.values, problem.numbers.input_lower, problem.numbers.input_upper))
    near = RIGHT * problem.input_scales
    at_low, at_high, largest = u <= low + near, u >= high - near, np.abs(slope).max(axis=0)
    outwards = np.where(at_low, -slope, 0.0) + np.where(at_high, slope, 0.0)
    assert (outwards <= ROUNDING * largest).all()
    free = np.where(at_low | at_high, 0.0, slope)
    assert (np.abs(free) <= RIGHT * largest).all()
    assert hard.max() <= RIGHT


def flat(horizon, growth, move, blocks):
    """Two inputs that do the same to one runaway state: only moves price what they do against each other."""
    rate = np.exp(growth / horizon) - 1.0
    model = rumo.Model(
        states={"x": "1"},
        inputs={"u": "1", "v": "1"},
        parameters={"rate": rumo.Parameter("1", rate)},
        dynamics=lambda x, u, p: {"x": p.rate * (x.x + u.u + 0.7 * u.v)},
    )
    return rumo.Problem(
        model,
        horizon=horizon,
        sampling_time=1.0,
        track={"x": rumo.Weight(1.0, range=0.5)},
        moves=dict.fromkeys("uv", rumo.Weight(move, range=2.0)),
        blocks=rumo.InputBlocks(blocks),
    )


def held_exactly(problem, blocks, x, target, before):
    """Inputs (N, 2) of such a plant that are held over blocks, in exact arithmetic."""
    N, n = problem.horizon, 2 * len(blocks)
    transcription, guess = Transcription(problem, rumo.ExplicitEuler()), np.zeros((N + 1, 1))
    stages = transcription.linearize(guess, np.zeros((N, 2)), np.zeros((N, 0)), problem.parameters)
    A, B, _ = (exact(array) for array in eliminate(stages))
    which, now = np.repeat(np.arange(len(blocks)), blocks), exact([x, *[0.0] * n])  # value and slopes by v
    terms = []
    for k in range(N):
        now = A[k, 0, 0] * now
        now[1 + 2 * which[k] : 3 + 2 * which[k]] += B[k, 0]
        terms.append((Fraction(problem.output_weights[k, 0]), now - exact([target, *[0.0] * n])))
    for i in range(n):
        change = exact([0.0 if i > 1 else -before[i], *np.eye(n)[i] - (np.eye(n)[i - 2] if i > 1 else 0.0)])
        terms.append((Fraction(problem.block_move_weights.ravel()[i]), change))
    H = sum(weight * np.outer(term[1:], np.r_[term[1:], term[:1]]) for weight, term in terms)
    for i in range(n):
        H[i] = H[i] / H[i, i]
        for j in (j for j in range(n) if j != i):
            H[j] = H[j] - H[j, i] * H[i]
    return -H[:, n].astype(float).reshape(-1, 2)[which]


SHORT, LONG = [10, 10, 5, 5], [20, 20, 10, 10]
FLAT = [(SHORT, 8, 1e-8), (LONG, 12, 1e-8), (LONG, 8, 1e-6), (SHORT, 5, 1e-2)]


@pytest.mark.usefixtures("kept_builds")
@pytest.mark.parametrize(
    ("backend", "blocks", "growth", "move"),
    [
        *cases(*FLAT),
        *(pytest.param("tailored", *case, marks=pytest.mark.slow) for case in FLAT),
    ],
)
def test_a_cost_so_flat_that_residuals_say_little(backend, blocks, growth, move):
    problem, before = flat(sum(blocks), growth, move, blocks), [0.01, -0.02]
    controller = made_with(problem, backend, rumo.ExplicitEuler(), gate=None)
    controller.reset(applied=[before])
    plan = controller.step([0.4], {"x": 0.1})
    assert plan.cause in (rumo.Status.OPTIMAL, rumo.Status.ILL_CONDITIONED)
    if growth < 12 and (backend != "condensing" or move > 1e-5):
        assert plan.status.solved
    if plan.status.solved:
        wrong = np.abs(plan.u.values - held_exactly(problem, blocks, 0.4, 0.1, before)) / problem.input_scales
        assert wrong.max() < RIGHT
