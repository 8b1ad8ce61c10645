"""Every scheme converges with the order that it declares: solved exactly, and by one Newton step per sample."""

import casadi as ca
import numpy as np
import pytest

import rumo
from rumo.registry import DISCRETIZATIONS
from rumo.simulation import Plant
from rumo.transcription import Transcription

DURATION, INPUT = 1.0, 0.3


def swing():
    """A damped pendulum: nothing stiff."""
    model = rumo.Model(
        states={"angle": "rad", "rate": "rad/s"},
        inputs={"torque": "1/s^2"},
        dynamics=lambda x, u, p: {"angle": x.rate, "rate": u.torque - 4.0 * ca.sin(x.angle) - 0.5 * x.rate**3},
    )
    return model, [1.0, 0.2], 2


def fast_and_slow(epsilon=1e-6):
    """Singularly perturbed: `fast` follows what `slow` and its phase tell it, so many times faster than they move."""
    model = rumo.Model(
        states={"slow": "1", "phase": "rad", "fast": "1"},
        inputs={"push": "1/s"},
        dynamics=lambda x, u, p: {
            "slow": -x.slow + x.fast + u.push,
            "phase": 1.0 + 0.3 * x.fast,
            "fast": (ca.cos(x.phase) - 0.5 * x.slow * x.fast - x.fast) / epsilon,
        },
    )
    # Where the fast state settles, to within epsilon.
    return model, [1.0, 0.5, np.cos(0.5) / 1.5], 2


def constrained():
    """The pendulum with its acceleration as an algebraic variable of a nonlinear equation."""
    model = rumo.Model(
        states={"angle": "rad", "rate": "rad/s"},
        inputs={"torque": "1/s^2"},
        dynamics=lambda x, u, p: {"angle": x.rate, "rate": u.torque - x.pull},
        algebraic={
            "pull": rumo.Algebraic(
                "1/s^2", lambda x, u, p: x.pull + 0.1 * x.pull**3 - 4.0 * ca.sin(x.angle) - 0.2 * x.rate, guess=2.0
            )
        },
    )
    return model, [1.0, 0.2], 2


SYSTEMS = {
    "swing": swing,
    "fast_and_slow": fast_and_slow,
    "not_so_fast": lambda: fast_and_slow(0.1),
    "constrained": constrained,
}
# Coarse enough for errors well above rounding, fine enough for the leading term: steps in DURATION.
STEPS = {1: (16, 32, 64), 2: (16, 32, 64), 3: (16, 32, 64), 4: (8, 16, 32), 5: (8, 12, 16)}
CASES = [
    pytest.param(scheme(), system, id=f"{name}-{system}")
    for name, scheme in DISCRETIZATIONS.items()
    for system in (("swing",) if scheme.explicit else ("swing", "fast_and_slow", "constrained"))
] + [
    pytest.param(scheme(substeps=4), "not_so_fast", id=f"{name}-not_so_fast")
    for name, scheme in DISCRETIZATIONS.items()
    if scheme.explicit
]


def problem_of(model, steps, **changes):
    settings = {
        "horizon": 1,
        "sampling_time": DURATION / steps,
        "track": {model.states.names[0]: rumo.Weight(0.0)},
        "moves": {model.inputs.names[0]: rumo.Weight(1.0)},
    }
    return rumo.Problem(model, **(settings | changes))


def exact(model, x):
    return Plant(model, DURATION, 1e-13, method="sundials").advance(
        np.array(x), np.array([INPUT]), model.default_parameters
    )


def solved(scheme, model, x, steps):
    """State at the end, each step solved by Newton's method to the end."""
    transcription, x = Transcription(problem_of(model, steps), scheme), np.array(x)
    for _ in range(steps):
        x = transcription.advance(x, np.array([INPUT]))[0][: len(x)]
    return x


def fitted(steps, errors):
    return np.polyfit(np.log(1.0 / np.array(steps)), np.log(errors), 1)[0]


@pytest.mark.parametrize(("scheme", "system"), CASES)
def test_order_of_the_nonlinear_solution(scheme, system):
    model, x, checked = SYSTEMS[system]()
    target, steps = exact(model, x), STEPS[scheme.order]
    errors = [np.abs(solved(scheme, model, x, n) - target)[:checked].max() for n in steps]
    assert fitted(steps, errors) == pytest.approx(scheme.order, abs=0.3), errors


@pytest.mark.parametrize(("scheme", "system"), CASES)
def test_order_of_repeated_iterations(scheme, system):
    """Only moves cost, so that the input stays and a step predicts; one Newton step a sample, while time goes on.

    The last stages are new and have had few Newton steps; at the middle of the horizon they are done.
    """
    model, x, checked = SYSTEMS[system]()
    steps, errors = STEPS[scheme.order], []
    for n in steps:
        # Samples come at the same times for all n, and the last ones see the same states.
        problem = problem_of(model, n, horizon=2 * n)
        controller = rumo.RealTimeIteration(problem, scheme, gate=None)
        controller.reset(applied=[INPUT])
        plant, state = Plant(model, DURATION / n, tolerance=1e-12), np.array(x)
        for _ in range(3 * n + 1):
            start, plan = state, controller.step(state, {problem.outputs.names[0]: 0.0})
            state = plant.advance(state, np.array([INPUT]), model.default_parameters)
        np.testing.assert_allclose(plan.u.values, INPUT, rtol=1e-9)
        errors.append(np.abs(plan.x.values[n] - exact(model, start))[:checked].max())
    assert fitted(steps, errors) == pytest.approx(scheme.order, abs=0.3), errors


@pytest.mark.parametrize("name", DISCRETIZATIONS)
def test_substeps_are_steps(name):
    model, start, _ = swing()
    x = np.array(start)
    whole = Transcription(problem_of(model, 8), DISCRETIZATIONS[name](substeps=5)).advance(x, np.array([INPUT]))[0][:2]
    part, state = Transcription(problem_of(model, 40), DISCRETIZATIONS[name]()), x
    for _ in range(5):
        state = part.advance(state, np.array([INPUT]))[0][:2]
    np.testing.assert_allclose(whole, state, rtol=0.0, atol=1e-12)
