"""Random programs of every kind that a controller could pose, and of some that it should not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rumo.bench.qp import QuadraticProgram

SOFTNESS = ("hard", "exact", "quadratic", "free", "mixed")
"""Of rows: none; l2 = 0; l2 > 0; l1 = 0 with l2 > 0; some of each."""


def size(seed: int, rows: int = 0) -> tuple[int, int]:
    """Numbers of variables, 1 to 60, and of rows, up to 120."""
    rng = np.random.default_rng(seed)
    return int(rng.integers(1, 61)), int(rng.integers(rows, 121))


def hessian(rng: np.random.Generator, n: int, condition: float = 100.0) -> np.ndarray:
    """Positive definite, eigenvalues from 1 down to 1 / condition."""
    Q, _ = np.linalg.qr(rng.normal(size=(n, n)))
    H = (Q * np.logspace(0.0, -np.log10(condition), n)) @ Q.T
    return 0.5 * (H + H.T)


def program(
    seed: int, n: int, m: int, *, condition: float = 100.0, softness: str = "hard", two_sided: bool = True
) -> QuadraticProgram:
    """A feasible program with bounds and rows of which many are active; its softness is one of `SOFTNESS`."""
    rng = np.random.default_rng([seed, n, m])
    inside = rng.uniform(-0.8, 0.8, n)
    A = rng.normal(size=(m, n)) * (rng.uniform(size=(m, n)) < rng.choice([0.3, 1.0]))
    room = rng.choice([0.0, 0.05, 0.5], m) * np.linalg.norm(A, axis=1)
    H = hessian(rng, n, condition)
    lower = np.where(rng.uniform(size=m) < 0.5, A @ inside - room - rng.exponential(0.3, m), -np.inf)
    kinds = {"hard": [0], "exact": [1], "quadratic": [2], "free": [3], "mixed": [0, 1, 2, 3]}[softness]
    kind = rng.choice(kinds, m)
    # Soft rows cannot always hold: their limits may be on the wrong side of the point inside.
    shift = np.where(kind > 0, rng.normal(size=m), 0.0)
    upper = A @ inside + room + shift
    lower = np.minimum(lower, upper - 0.1 * (kind > 0))
    price = 10.0 ** rng.uniform(-3.0, 0.0, m)
    return QuadraticProgram(
        hessian=H,
        gradient=H @ rng.normal(size=n) * 10.0 ** rng.uniform(-0.5, 1.0),
        lower=np.full(n, -1.0),
        upper=np.where(rng.uniform(size=n) < 0.8, 1.0, np.inf),
        rows=A,
        row_lower=lower if two_sided else np.full(m, -np.inf),
        row_upper=upper,
        l1=np.where(kind == 0, np.inf, np.where(kind == 3, 0.0, price)),
        l2=np.where(kind >= 2, 10.0 ** rng.uniform(-3.0, 2.0, m), 0.0),
    )


def in_units(p: QuadraticProgram, rows: np.ndarray, cost: float = 1.0) -> QuadraticProgram:
    """The same program with rows and cost in other units."""
    return replace(
        p,
        hessian=cost * p.hessian,
        gradient=cost * p.gradient,
        rows=rows[:, None] * p.rows,
        row_lower=rows * p.row_lower,
        row_upper=rows * p.row_upper,
        l1=cost * p.l1 / rows,
        l2=cost * p.l2 / rows**2,
    )


def degenerate(seed: int, n: int, m: int, softness: str = "hard") -> QuadraticProgram:
    """Duplicate, opposite and parallel rows, rows equal to bounds, equal limits, more limits through a point than n."""
    rng = np.random.default_rng([seed, n, m, 1])
    p = program(seed, n, m, softness=softness)
    A, lower, upper = p.rows.copy(), p.row_lower.copy(), p.row_upper.copy()
    corner = rng.choice([-1.0, 1.0], n)  # of the bounds
    for i in range(m):
        what = rng.integers(7)
        other = rng.integers(m)
        if what == 0:  # the same row again, or its opposite
            factor = rng.choice([1.0, -1.0, 2.0])
            A[i], (lower[i], upper[i]) = factor * A[other], sorted(factor * np.array([lower[other], upper[other]]))
        elif what == 1:  # a bound again
            A[i], lower[i], upper[i] = np.eye(n)[rng.integers(n)], -1.0, 1.0
        elif what == 2:  # through a corner of the bounds, which it does not cut off
            A[i] = np.abs(A[i]) * corner
            lower[i], upper[i] = -np.inf, A[i] @ corner
        elif what == 3:  # a sum of two others
            A[i] = A[other] + A[other - 1]
            lower[i], upper[i] = lower[other] + lower[other - 1], upper[other] + upper[other - 1]
        elif what == 4:  # small whole numbers
            A[i] = rng.integers(-1, 2, n)
            lower[i], upper[i] = -np.inf, np.abs(A[i]).sum()
        elif what == 5 and np.isinf(p.l1[i]):  # a single value, at a point where all rows could hold
            lower[i] = upper[i] = 0.5 * (max(lower[i], upper[i] - 2.0) + upper[i])
    return replace(p, rows=A, row_lower=lower, row_upper=upper)
