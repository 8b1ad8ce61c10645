"""Any horizon of any model, whatever its scheme, delay, grid and blocks: Riccati = condensing = reference."""

import numpy as np
import pytest
from problems import BACKENDS, made_with
from test_backends import CASES, NOT_STIFF, PENALTIES, SCHEMES, WIDE, assert_same, drive

import rumo

MODELS = CASES | {name: WIDE[name] for name in ("rod", "tube", "chain", "pipeline")}
HORIZONS = (*range(1, 21), 24, 27, 33, 40, 47, 60, 64, 65, 81, 100, 128, 150, 177, 200)
RARELY = (2, 13, 40, 100)
"""Of wide models: the reference takes seconds for each sample."""
UNSTABLE = ("cart_pendulum", "van_der_pol")
"""Without inputs of ours for long, they are where no linearisation holds."""
MAY_NOT_KNOW = {"reference": ("chain", "heat_rod"), "riccati": (), "condensing": UNSTABLE}
"""Which models may be ILL_CONDITIONED to whom.

A force hardly reaches the end of a chain: units from 1e-20 on. The heating of a rod is at bounds for most of a long
horizon, where the reference's Newton method may not find which.
"""
NEAR = 1.0
"""From the dynamics, over the inputs' reach: guesses beyond are not compared, since rounding grows in them."""


def variation(name, horizon, softness):
    """Scheme, grid, delay and blocks: any of them, but the same ones every time."""
    rng = np.random.default_rng([*f"{name} {softness}".encode(), horizon])
    scheme = rng.choice([key for key, scheme in SCHEMES.items() if name in NOT_STIFF or not scheme.explicit])
    delay = int(rng.choice([0, min(1, horizon - 1), rng.integers(horizon), horizon - 1]))
    free, blocks = horizon - delay, None
    lengths = np.r_[np.ones(delay + 1), rng.uniform(0.5, 1.5, free - 1)]
    sampling_time = MODELS[name](1, 0, None)[0].sampling_time
    grid = horizon if rng.uniform() < 0.5 else rumo.Grid(sampling_time * lengths)
    kind = rng.choice([None, rumo.InputBlocks, rumo.IncrementBlocks])
    if kind is not None:
        ends = np.cumsum(rng.integers(1, 6, free))
        blocks = kind(np.diff([0, *ends[ends < free], free]).tolist())
    return scheme, grid, delay, blocks


def comparable(name, delay):
    """How many samples are compared."""
    if name in UNSTABLE and delay > 20:
        return 1
    return 2 if name in WIDE else 4


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "horizon", "softness"),
    [
        pytest.param(name, horizon, softness, id=f"{name}-{horizon}-{softness}")
        for name in MODELS
        for horizon in (RARELY if name in WIDE else HORIZONS)
        for softness in PENALTIES
    ],
)
def test_plans_are_the_same(name, horizon, softness):
    scheme, grid, delay, blocks = variation(name, horizon, softness)
    problem, x, wanted = MODELS[name](grid, delay, PENALTIES[softness], blocks=blocks)
    controllers = [made_with(problem, backend, SCHEMES[scheme], gate=None) for backend in BACKENDS]
    for i, plans in enumerate(drive(controllers, problem, x, wanted, comparable(name, delay))):
        _, riccati, _ = plans
        if i > 0 and riccati.diagnostics.integrator_residual > NEAR:
            break
        if i == 0 and softness != "hard":
            assert riccati.status.solved
        known = [
            plan
            for plan, backend in zip(plans, BACKENDS, strict=True)
            if plan.cause is not rumo.Status.ILL_CONDITIONED or name not in MAY_NOT_KNOW[backend]
        ]
        for plan in known:
            assert_same(problem, riccati, plan, 1e-8)
            assert not plan.status.solved or plan.diagnostics.kkt_residual < 1e-9
        if len(known) < len(plans):
            break
