"""The model as a tape: every operation and any expression has CasADi's value, in the portable and the tailored core."""

import shutil
from itertools import pairwise

import casadi as ca
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import rumo
from rumo.controllers.engines.described import core_problem
from rumo.kernel.tape import OPERATIONS

FAR = [(1.000001e6, 0.0), (-3.7e9, 0.0), (2.0**53 + 2.0, 0.0), (6381956970095103.0 * 2.0**797, 0.0), (1e300, 0.0)]
"""Angles that only an exact reduction makes anything of; the last but one is next to a multiple of pi / 2."""

# Expressions of two numbers, and points in their domain. A constraint must depend on a state: hence some `+ a`.
EXPRESSIONS = {
    "constant": (lambda a, b: 2.5 + a, [(1.0, 1.0)]),
    "add": (lambda a, b: a + b, [(1.5, -0.3)]),
    "sub": (lambda a, b: a - b, [(1.5, -0.3)]),
    "mul": (lambda a, b: a * b, [(1.5, -0.3), (0.0, 2.0)]),
    "div": (lambda a, b: a / b, [(1.5, -0.3)]),
    "neg": (lambda a, b: -ca.sin(a), [(1.5, 0.0)]),
    "inv": (lambda a, b: 1.0 / a, [(1.5, 0.0), (-3.0, 0.0)]),
    "sq": (lambda a, b: a**2, [(1.5, 0.0), (-3.0, 0.0)]),
    "twice": (lambda a, b: 2.0 * a, [(1.5, 0.0)]),
    "sqrt": (lambda a, b: ca.sqrt(a), [(1.5, 0.0)]),
    "sin": (lambda a, b: ca.sin(a), [(1.5, 0.0), (-200.0, 0.0), *FAR]),
    "cos": (lambda a, b: ca.cos(a), [(1.5, 0.0), (-200.0, 0.0), *FAR]),
    "tan": (lambda a, b: ca.tan(a), [(1.4, 0.0), (-200.0, 0.0), *FAR]),
    "asin": (lambda a, b: ca.asin(a), [(0.4, 0.0), (-0.9, 0.0)]),
    "acos": (lambda a, b: ca.acos(a), [(0.4, 0.0), (-0.9, 0.0)]),
    "atan": (lambda a, b: ca.atan(a), [(0.4, 0.0), (-9.0, 0.0), (1e9, 0.0)]),
    "atan2": (lambda a, b: ca.atan2(a, b), [(0.4, -1.0), (-0.9, -2.0)]),
    "sinh": (lambda a, b: ca.sinh(a), [(0.4, 0.0), (-9.0, 0.0)]),
    "cosh": (lambda a, b: ca.cosh(a), [(0.4, 0.0), (-9.0, 0.0)]),
    "tanh": (lambda a, b: ca.tanh(a), [(0.4, 0.0), (-9.0, 0.0)]),
    "asinh": (lambda a, b: ca.asinh(a), [(0.4, 0.0), (-9.0, 0.0)]),
    "acosh": (lambda a, b: ca.acosh(a), [(1.4, 0.0), (9.0, 0.0)]),
    "atanh": (lambda a, b: ca.atanh(a), [(0.4, 0.0), (-0.9, 0.0)]),
    "exp": (lambda a, b: ca.exp(a), [(0.4, 0.0), (-9.0, 0.0)]),
    "expm1": (lambda a, b: ca.expm1(a), [(1e-9, 0.0), (-9.0, 0.0)]),
    "log": (lambda a, b: ca.log(a), [(0.4, 0.0), (9.0, 0.0)]),
    "log1p": (lambda a, b: ca.log1p(a), [(1e-9, 0.0), (9.0, 0.0)]),
    "pow": (lambda a, b: a**b + a**1.7, [(0.4, 2.5), (9.0, -0.5)]),
    "hypot": (lambda a, b: ca.hypot(a, b), [(0.4, 2.5), (-3.0, 4.0)]),
    "erf": (lambda a, b: ca.erf(a), [(0.4, 0.0), (-1.0, 0.0)]),
    "fabs": (lambda a, b: ca.fabs(a), [(0.4, 0.0), (-9.0, 0.0)]),
    "sign": (lambda a, b: ca.sign(a), [(0.4, 0.0), (-9.0, 0.0), (0.0, 0.0)]),
    "copysign": (lambda a, b: ca.copysign(a, b), [(0.4, -1.0), (-9.0, 1.0)]),
    "floor": (lambda a, b: ca.floor(a), [(0.4, 0.0), (-0.4, 0.0), (3.0, 0.0)]),
    "ceil": (lambda a, b: ca.ceil(a), [(0.4, 0.0), (-0.4, 0.0), (3.0, 0.0)]),
    "fmod": (lambda a, b: ca.fmod(a, b), [(7.4, 3.0), (-7.4, 3.0)]),
    "fmin": (lambda a, b: ca.fmin(a, b), [(0.4, 1.0), (2.0, 1.0)]),
    "fmax": (lambda a, b: ca.fmax(a, b), [(0.4, 1.0), (2.0, 1.0)]),
    "lt": (lambda a, b: (a < b) + a, [(0.4, 1.0), (2.0, 1.0), (1.0, 1.0)]),
    "le": (lambda a, b: (a <= b) + a, [(0.4, 1.0), (2.0, 1.0), (1.0, 1.0)]),
    "eq": (lambda a, b: (a == b) + a, [(0.4, 1.0), (1.0, 1.0)]),
    "ne": (lambda a, b: (a != b) + a, [(0.4, 1.0), (1.0, 1.0)]),
    "not": (lambda a, b: ca.logic_not(a) + a, [(0.0, 0.0), (2.0, 0.0)]),
    "and": (lambda a, b: ca.logic_and(a, b) + a, [(0.0, 1.0), (2.0, 1.0)]),
    "or": (lambda a, b: ca.logic_or(a, b) + a, [(0.0, 1.0), (0.0, 0.0)]),
    "if_else_zero": (lambda a, b: ca.if_else(a < b, a, b * b), [(0.4, 1.0), (2.0, 1.0)]),
}
# Always there, or only an alias that CasADi removes by itself.
UNWRITTEN = {"input", "output", "assign"}


def frozen(expressions):
    """A problem whose states a, b never change, and whose slacks at stage 1 are each expression's two signs."""
    model = rumo.Model(
        states={"a": "1", "b": "1", "c": "1"},
        inputs={"u": "1"},
        dynamics=lambda x, u, p: {"a": 0.0, "b": 0.0, "c": u.u},
    )
    constraints = {}
    for i, expression in enumerate(expressions):
        for name, sign in (("plus", 1.0), ("minus", -1.0)):
            constraints[f"{name}_{i}"] = rumo.Constraint(
                lambda x, u, p, e=expression, s=sign: s * e(x.a, x.b), penalty=rumo.Penalty(1.0)
            )
    return rumo.Problem(
        model,
        horizon=2,
        sampling_time=0.1,
        track={"c": rumo.Weight(1.0)},
        moves={"u": rumo.Weight(1.0)},
        constraints=constraints,
        delay=1,
    )


def values(controller, a, b):
    """What the core makes of the expressions."""
    controller.reset([a, b, 0.0])
    plan = controller.step([a, b, 0.0], {"c": 0.0})
    assert plan.status.solved, plan.status
    slacks = plan.slacks.values[0]
    return slacks[::2] - slacks[1::2]


def exact(expression, a, b):
    """Value and derivatives by CasADi's own evaluation."""
    x = ca.SX.sym("x", 2)
    function = ca.Function("f", [x], [ca.SX(expression(x[0], x[1])), ca.jacobian(ca.SX(expression(x[0], x[1])), x)])
    value, slope = function([a, b])
    return float(value), slope.full().ravel()


@pytest.mark.parametrize("name", EXPRESSIONS)
def test_operation(name):
    expression, points = EXPRESSIONS[name]
    controller = rumo.RealTimeIteration(frozen([expression]), backend="portable", gate=None)
    for a, b in points:
        value, _ = exact(expression, a, b)
        np.testing.assert_allclose(values(controller, a, b), [value], rtol=1e-14, atol=1e-300)


def test_every_operation_is_written():
    assert set(EXPRESSIONS) | UNWRITTEN == set(OPERATIONS)
    controller = rumo.RealTimeIteration(frozen([e for e, _ in EXPRESSIONS.values()]), backend="portable")
    written = {OPERATIONS[code] for code in core_problem(controller.transcription).tape.code[:, 0]}
    assert written >= set(OPERATIONS) - {"assign"}


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler (cc) on this machine")
def test_all_operations_in_a_tailored_build(tmp_path, monkeypatch):
    monkeypatch.setenv("RUMO_CACHE", str(tmp_path))
    # All at once, so each at points in every domain.
    expressions = [expression for expression, _ in EXPRESSIONS.values()]
    inside = [lambda a, b, e=e: e(1.05 + 0.4 * a, b) for e in expressions if e is EXPRESSIONS["acosh"][0]]
    expressions = [e for e in expressions if e is not EXPRESSIONS["acosh"][0]] + inside
    controllers = [
        rumo.RealTimeIteration(frozen(expressions), backend=backend, gate=None) for backend in ("portable", "tailored")
    ]
    assert controllers[1].backend == "tailored"
    rng = np.random.default_rng(0)
    for a, b in rng.uniform(0.05, 0.95, (40, 2)):
        expected = [exact(expression, a, b)[0] for expression in expressions]
        for controller in controllers:
            np.testing.assert_allclose(values(controller, a, b), expected, rtol=1e-13, atol=1e-300)


ROTOR = rumo.Model(
    states={"angle": "rad", "rate": "rad/s"},
    inputs={"torque": "N m"},
    dynamics=lambda x, u, p: {"angle": x.rate, "rate": u.torque - ca.sin(x.angle) * ca.cos(x.angle)},
)


def swing(horizon):
    """A rotor with two equilibria a turn, wherever it has come to; the smaller of two numbers hides what is not one."""
    return rumo.Problem(
        ROTOR,
        horizon=horizon,
        sampling_time=0.05,
        track={"rate": rumo.Weight(1.0)},
        moves={"torque": rumo.Weight(0.1)},
        bounds={"torque": (-3.0, 3.0)},
        constraints={"turned": rumo.Constraint(lambda x, u, p: ca.fmin(ca.tan(x.angle), 0.5), rumo.Penalty(0.1))},
    )


@pytest.mark.parametrize("backend", ["portable", pytest.param("tailored", marks=pytest.mark.slow)])
@pytest.mark.parametrize("horizon", [3, 20])
@pytest.mark.parametrize("angle", [1e6 - 0.3, -1e6 + 0.2, 3.3e8, -7.1e11])
def test_angles_of_any_size(kept_builds, backend, horizon, angle):
    """As a rotor that turns at 600 rad/s comes to within half an hour; some stages beyond 1e6 rad, and some before."""
    if backend == "tailored" and (shutil.which("cc") is None or abs(angle) > 1e7 or horizon < 20):
        pytest.skip("compiled once, and where there is a compiler")
    wanted, plans = {"rate": 1.0}, []
    for name in ("reference", backend):
        controller = rumo.RealTimeIteration(swing(horizon), backend=name, gate=None)
        for _ in range(3):
            plan = controller.step([angle, 8.0], wanted)
        plans.append(plan)
    assert plans[1].status is plans[0].status
    assert plans[1].status.solved
    for part in ("u", "slacks"):
        ours, expected = (getattr(plan, part).values for plan in (plans[1], plans[0]))
        np.testing.assert_allclose(ours, expected, atol=1e-6 * max(1.0, abs(angle) / 1e6))


def test_divisions_by_the_same_number_are_one():
    """Three by a + b, one of them twice with its derivatives; and by a constant, which is none."""
    expressions = [lambda a, b: a / (a + b), lambda a, b: ca.sin(a) / (a + b), lambda a, b: 1.0 / (a + b) + a / 3.0]
    controller = rumo.RealTimeIteration(frozen(expressions), backend="portable", gate=None)
    names = [OPERATIONS[code] for code in core_problem(controller.transcription).tape.code[:, 0]]
    assert names.count("inv") + names.count("div") == 1
    runs = 1 + sum(before != after for before, after in pairwise(names))
    assert runs < 0.6 * len(names), "instructions of one kind follow each other"
    for a, b in ((0.3, 0.9), (-2.0, 7.0)):
        np.testing.assert_allclose(values(controller, a, b), [exact(e, a, b)[0] for e in expressions], rtol=1e-15)


ONE = {
    "sin": ca.sin,
    "cos": ca.cos,
    "atan": ca.atan,
    "tanh": ca.tanh,
    "sqrt": lambda a: ca.sqrt(1.0 + a**2),
    "exp": lambda a: ca.exp(-(a**2)),
    "log": lambda a: ca.log(2.0 + a**2),
    "fabs": ca.fabs,
    "neg": lambda a: -a,
    "inv": lambda a: 1.0 / (1.0 + a**2),
}
TWO = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / (2.0 + b**2),
    "fmin": ca.fmin,
    "fmax": ca.fmax,
    "atan2": lambda a, b: ca.atan2(a, 1.0 + b**2),
    "hypot": lambda a, b: ca.hypot(a, 1.0 + b),
    "if": lambda a, b: ca.if_else(a < 0.37, b, 2.0 * b),
}
leaves = st.sampled_from(["a", "b"]) | st.floats(-3.0, 3.0).map(lambda value: round(value, 3))
trees = st.recursive(
    leaves,
    lambda inner: (
        st.tuples(st.sampled_from(sorted(ONE)), inner) | st.tuples(st.sampled_from(sorted(TWO)), inner, inner)
    ),
    max_leaves=12,
)


def written(tree):
    """The expression that a tree stands for."""

    def of(a, b):
        def visit(node):
            if isinstance(node, tuple):
                name, *operands = node
                return (ONE | TWO)[name](*map(visit, operands))
            return {"a": a, "b": b}.get(node, node)

        return visit(tree) + 1e-3 * a

    return of


@settings(max_examples=60, deadline=None)
@given(tree=trees, points=st.lists(st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)), min_size=1, max_size=4))
def test_random_expression(tree, points):
    expression = written(tree)
    controller = rumo.RealTimeIteration(frozen([expression]), backend="portable", gate=None)
    for a, b in points:
        value, slope = exact(expression, a, b)
        assume(np.isfinite(slope).all() and abs(value) < 1e6 and np.abs(slope).max() < 1e6)
        np.testing.assert_allclose(values(controller, a, b), [value], rtol=1e-9, atol=1e-9)
