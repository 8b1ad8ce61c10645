"""Random problems: whatever a model, a scheme, a horizon and its limits may be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

import rumo
from rumo import discretization as schemes

IMPLICIT = (
    schemes.ImplicitEuler,
    schemes.ImplicitMidpoint,
    schemes.Trapezoidal,
    schemes.Radau2,
    schemes.Sdirk2,
    schemes.Gauss2,
)
EXPLICIT = (schemes.ExplicitEuler, schemes.Rk4)
SOLVERS = ("riccati", "condensing")


@dataclass(frozen=True)
class Drawn:
    """A problem with a scheme, a solver, and the typical size of each state (nx,)."""

    problem: rumo.Problem
    scheme: rumo.Discretization
    solver: Any
    sizes: np.ndarray


def log_uniform(rng, low, high, size=None):
    """Exponents evenly between those of 10**low and 10**high."""
    return 10.0 ** rng.uniform(low, high, size)


def chance(rng, share):
    return bool(rng.uniform() < share)


def draw(rng) -> Drawn:
    """A problem with 1 to 6 states, 1 to 3 inputs and 1 to 25 intervals."""
    nx, nu, h = int(rng.integers(1, 7)), int(rng.integers(1, 4)), float(log_uniform(rng, -3.0, 1.0))
    explicit = chance(rng, 0.25)
    scheme = rng.choice(EXPLICIT if explicit else IMPLICIT)(substeps=int(rng.choice([1, 1, 1, 2, 3])))
    xs, us = log_uniform(rng, -2.0, 2.0, nx), log_uniform(rng, -2.0, 2.0, nu)
    model = draw_model(rng, xs, us, h, explicit)
    horizon = int(rng.integers(1, 9) if chance(rng, 0.85) else rng.integers(9, 26))
    delay = int(rng.integers(0, min(4, horizon)))
    lengths = h * log_uniform(rng, 0.0, 0.1 * chance(rng, 0.2)) ** np.maximum(np.arange(horizon) - delay, 0)
    problem = rumo.Problem(
        model,
        horizon=rumo.Grid(lengths.tolist()) if lengths[-1] > h else horizon,
        sampling_time=h,
        delay=delay,
        track=draw_track(rng, model, xs, horizon),
        moves={
            name: rumo.Weight(draw_weight(rng, horizon, -5.0, 1.0), range=float(size * log_uniform(rng, -1.0, 1.0)))
            for name, size in zip(model.inputs, us, strict=True)
        },
        blocks=draw_blocks(rng, horizon - delay),
        parameters={"a": rng.uniform(0.5, 1.5, horizon)} if chance(rng, 0.3) else {"a": float(rng.uniform(0.5, 1.5))},
        measurements=draw_measurements(rng, xs, horizon),
        **draw_limits(rng, model, xs, us, horizon),
    )
    return Drawn(problem, scheme, rng.choice(SOLVERS), xs)


def draw_measurements(rng, xs, horizon) -> dict[str, rumo.Measurement]:
    """What is known of a sensor by chance; apart from what follows, how old some readings are."""
    known = {"noise": 0.01 * xs[0], "resolution": 1e-3 * xs[0]} if chance(rng, 0.2) else {}
    (late,) = rng.spawn(1)
    ages = late.integers(0, horizon + 1, len(xs)) * chance(late, 0.1) * (late.uniform(size=len(xs)) < 0.5)
    drawn = {f"x{i}": {"age": int(age)} for i, age in enumerate(ages) if age}
    if known:
        drawn["x0"] = drawn.get("x0", {}) | known
    return {name: rumo.Measurement(**said) for name, said in drawn.items()}


def draw_model(rng, xs, us, h, explicit) -> rumo.Model:
    """Linear terms, slow, stiff or unstable in units of the sampling time, and others by chance."""
    nx, nu = len(xs), len(us)
    rate = log_uniform(rng, -2.0, -0.3, nx) / h
    A = rng.normal(size=(nx, nx)) / nx - np.eye(nx) * rng.choice([0.0, 1.0])
    if not explicit and chance(rng, 0.3):
        A[0, 0] = -log_uniform(rng, 1.0, 5.0)
    if chance(rng, 0.2):
        A[-1, -1] = log_uniform(rng, -1.0, 1.0)
    A *= rng.uniform(size=A.shape) < rng.choice([0.4, 1.0])
    B = rng.normal(size=(nx, nu)) * (rng.uniform(size=(nx, nu)) < rng.choice([0.4, 1.0]))
    B[rng.integers(nx), :] = rng.choice([-1.0, 1.0], nu)
    angle = int(rng.integers(nx)) if chance(rng, 0.2) else -1
    A[:, angle] *= angle < 0
    size = np.where(np.arange(nx) == angle, 1.0, xs)
    other = [] if chance(rng, 0.25) else draw_terms(rng, nx, nu, int(rng.integers(1, 2 * nx + 1)))
    algebraic = not explicit and chance(rng, 0.15)

    def scaled(x, u):
        states = [x[f"x{i}"] / s for i, s in enumerate(size)]
        if angle >= 0:
            states[angle] = ca.sin(states[angle])
        return states, [u[f"u{j}"] / s for j, s in enumerate(us)]

    def dynamics(x, u, p):
        s, v = scaled(x, u)
        slopes = [sum(A[i, j] * s[j] for j in range(nx)) + sum(B[i, j] * v[j] for j in range(nu)) for i in range(nx)]
        for term in other:
            slopes[term.row] += p.a * term.value(s, v)
        if algebraic:
            slopes[0] += 0.3 * x.z
        return {f"x{i}": float(rate[i] * size[i]) * slopes[i] for i in range(nx)}

    def equation(x, u, p):
        s, v = scaled(x, u)
        return x.z + 0.3 * ca.sin(x.z) - s[0] - 0.5 * v[0] * p.a

    outcome = draw_terms(rng, nx, nu, 2)
    return rumo.Model(
        states={f"x{i}": "rad" if i == angle else "1" for i in range(nx)},
        inputs={f"u{j}": "1" for j in range(nu)},
        dynamics=dynamics,
        parameters={"a": rumo.Parameter("1", 1.0)},
        outputs={
            f"y{i}": rumo.Output("1", lambda x, u, p, term=term: term.value(*scaled(x, u)))
            for i, term in enumerate(outcome)
        },
        algebraic={"z": rumo.Algebraic("1", equation)} if algebraic else None,
    )


@dataclass(frozen=True)
class Term:
    """A nonlinear term in row `row` of scaled states s and inputs v."""

    row: int
    kind: int
    i: int
    j: int
    gain: float

    def value(self, s, v):
        a, b, u = s[self.i], s[self.j], v[self.j % len(v)]
        kinds = (ca.sin(a), a * b, a**2, ca.tanh(a), a * u, ca.sqrt(1.0 + a**2), ca.exp(-(a**2)), a / (1.0 + b**2))
        return self.gain * kinds[self.kind]


def draw_terms(rng, nx, nu, count):
    """Of all kinds, products and squares among them, by which states run away in finite time."""
    return [
        Term(int(rng.integers(nx)), int(rng.integers(8)), int(rng.integers(nx)), int(rng.integers(nx)), rng.normal())
        for _ in range(count)
    ]


def draw_weight(rng, horizon, low, high):
    """One number, or one for each stage, the last of which may be much larger."""
    if chance(rng, 0.6):
        return float(log_uniform(rng, low, high))
    weights = log_uniform(rng, low, high) * log_uniform(rng, -0.5, 0.5, horizon)
    weights[-1] *= log_uniform(rng, 0.0, 3.0)
    return weights


def draw_track(rng, model, xs, horizon):
    """Some states, outputs and algebraic variables."""
    names = [*model.states, *model.outputs, *model.algebraic]
    chosen = rng.choice(names, int(rng.integers(1, min(4, len(names)) + 1)), replace=False)
    sizes = dict(zip(model.states, xs, strict=True))
    track = {}
    for name in chosen.tolist():
        weights = np.broadcast_to(draw_weight(rng, horizon, -2.0, 2.0), horizon)
        if chance(rng, 0.2):
            weights = weights * (rng.uniform(size=horizon) < 0.7)
        track[name] = rumo.Weight(weights, range=float(sizes.get(name, 1.0) * log_uniform(rng, -1.0, 1.0)))
    return track


def draw_blocks(rng, free):
    """Blocks of inputs or increments, or none."""
    if chance(rng, 0.7):
        return None
    ends = np.cumsum(rng.integers(1, 5, free))
    return rng.choice([rumo.InputBlocks, rumo.IncrementBlocks])(np.diff([0, *ends[ends < free], free]).tolist())


def draw_penalty(rng):
    """None for hard limits; small prices, which are not exact, and large ones."""
    if chance(rng, 0.3):
        return None
    return rumo.Penalty(float(log_uniform(rng, -2.0, 3.0)), float(chance(rng, 0.5) * log_uniform(rng, -2.0, 3.0)))


def draw_limits(rng, model, xs, us, horizon):
    """Bounds of inputs, their moves and states, and constraints: none, one or many."""
    bounds, move_bounds, constraints = {}, {}, {}
    for name, size in zip(model.inputs, us.tolist(), strict=True):
        if chance(rng, 0.85):
            bounds[name] = draw_interval(rng, size, horizon)
        if chance(rng, 0.25):
            move_bounds[name] = (-size * log_uniform(rng, -1.5, 0.5), size * log_uniform(rng, -1.5, 0.5))
    for name, size in zip(model.states, xs.tolist(), strict=True):
        if chance(rng, 0.25):
            bounds[name] = rumo.Bounds(*draw_interval(rng, 2.0 * size, horizon), draw_penalty(rng))
    for i, term in enumerate(draw_terms(rng, len(xs), len(us), int(rng.integers(0, 3)))):
        expression = constrained(term, xs, us)
        limit = rng.uniform(0.2, 3.0, horizon) if chance(rng, 0.3) else float(rng.uniform(0.0, 3.0))
        constraints[f"c{i}"] = rumo.Constraint(expression, draw_penalty(rng), limit)
    return {"bounds": bounds, "move_bounds": move_bounds, "constraints": constraints}


def constrained(term, xs, us):
    def expression(x, u, p):
        states = [x[f"x{i}"] / size for i, size in enumerate(xs)]
        return term.value(states, [u[f"u{j}"] / size for j, size in enumerate(us)]) * p.a

    return expression


def draw_interval(rng, size, horizon):
    """Two limits around zero, of which one may be missing, or one pair for each interval."""
    low, high = -size * log_uniform(rng, -1.0, 0.7), size * log_uniform(rng, -1.0, 0.7)
    if chance(rng, 0.2):
        shares = rng.uniform(0.5, 1.0, horizon)
        return low * shares, high * shares
    missing = rng.uniform()
    return (-np.inf if missing < 0.1 else low), (np.inf if 0.1 <= missing < 0.2 else high)
