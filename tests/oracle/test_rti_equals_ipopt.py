"""RTI iterated to convergence on frozen data is IPOPT's solution of the same discretised problem."""

from itertools import pairwise

import numpy as np
import pytest
from problems import PROBLEMS, car

import rumo
from rumo.controllers import NlpSettings, QpOptions
from rumo.registry import DISCRETIZATIONS


def relative(ours, oracle):
    """Largest difference, each signal over its largest value on the horizon."""
    scale = np.abs(oracle).max(axis=0)
    return np.max(np.abs(ours - oracle) / np.where(scale > 0.0, scale, 1.0))


def solve_both(problem, x, reference, scheme=None):
    rti = rumo.RealTimeIteration(problem, scheme, sqp_iterations=100, tolerance=1e-12, qp=QpOptions(tolerance=1e-12))
    nlp = rumo.DirectNlp(problem, scheme, settings=NlpSettings(tolerance=1e-11, max_iterations=1000))
    return rti.step(x, reference), nlp.step(x, reference)


@pytest.mark.parametrize("name", PROBLEMS)
def test_converged_rti_is_the_nlp_solution(name):
    ours, oracle = solve_both(*PROBLEMS[name]())
    assert ours.status.solved
    assert ours.status == oracle.status
    assert relative(ours.x.values, oracle.x.values) < 1e-6
    assert relative(ours.u.values, oracle.u.values) < 1e-6
    np.testing.assert_allclose(ours.slacks.values, oracle.slacks.values, atol=1e-6)


# On the others, full Newton steps from a guess at rest do not converge for schemes that leave fast modes undamped.
ALL_SCHEMES = ("swinging_cart", "cooled_reactor", "algebraic")


@pytest.mark.parametrize(
    ("scheme", "name"),
    [
        pytest.param(
            scheme(substeps=m), name, id=f"{m}-{key}-{name}", marks=() if (i + j + m // 2) % 2 else pytest.mark.slow
        )
        for i, (key, scheme) in enumerate(DISCRETIZATIONS.items())
        for j, name in enumerate((*PROBLEMS, "algebraic"))
        for m in (1, 3)  # any two together, all three in slow tests
        if (scheme.l_stable or name in ALL_SCHEMES) and not (scheme.explicit and name == "algebraic")
    ],
)
def test_every_scheme(scheme, name):
    problem, x, reference = algebraic() if name == "algebraic" else PROBLEMS[name]()
    ours, oracle = solve_both(problem, x, reference, scheme)
    assert ours.status.solved
    assert ours.status == oracle.status
    assert relative(ours.x.values, oracle.x.values) < 1e-6
    assert relative(ours.u.values, oracle.u.values) < 1e-6
    if problem.model.algebraic:
        assert relative(ours.z.values, oracle.z.values) < 1e-6


def algebraic():
    """A heater whose current is an algebraic variable of a nonlinear equation, limited and tracked."""
    model = rumo.Model(
        states={"temperature": "K", "voltage": "V"},
        inputs={"rate": "V/s"},
        dynamics=lambda x, u, p: {
            "temperature": 0.2 * x.voltage * x.current - 0.1 * x.temperature,
            "voltage": u.rate,
        },
        algebraic={
            "current": rumo.Algebraic(
                "A",
                lambda x, u, p: x.voltage - (2.0 + 0.05 * x.temperature) * x.current - 0.3 * x.current**3,
                guess=0.5,
            )
        },
    )
    problem = rumo.Problem(
        model,
        horizon=15,
        sampling_time=0.5,
        delay=1,
        track={"temperature": rumo.Weight(1.0, range=10.0), "current": rumo.Weight(0.01)},
        moves={"rate": rumo.Weight(0.1, range=2.0)},
        bounds={"rate": (-1.0, 1.0), "current": rumo.Bounds(upper=1.9, penalty=rumo.Penalty(10.0))},
    )
    return problem, [2.0, 1.0], {"temperature": 15.0, "current": 1.0}


@pytest.mark.parametrize("l1", [0.003, 0.01])
def test_violated_friction_circles_are_shared_alike(l1):
    # At 14 m/s, 1 m beside the path, so low a price makes violating the friction limit worth while.
    weights = {
        "p_x": rumo.Weight(10.0, 50.0),
        "p_y": rumo.Weight(10.0, 6.0),
        "psi": rumo.Weight(1.0, 0.6),
        "v_x": rumo.Weight(1.0, 10.0),
    }
    ours, oracle = solve_both(*car(14.0, 50.0, rumo.Penalty(l1, l2=l1), weights))
    assert ours.status is rumo.Status.SOFT_VIOLATED
    assert ours.slacks.values.max() > 0.1
    assert relative(ours.x.values, oracle.x.values) < 1e-6
    assert relative(ours.u.values, oracle.u.values) < 1e-6
    np.testing.assert_allclose(ours.slacks.values, oracle.slacks.values, atol=1e-6)


@pytest.mark.parametrize("delay", [0, 1, 2, 3])
def test_every_delay(delay):
    from problems import pendulum

    problem = pendulum(delay=delay, move_bounds={"torque": (-0.7, 0.7)})
    rti = rumo.RealTimeIteration(problem)  # linear model: one iteration is the solution
    nlp = rumo.DirectNlp(problem, settings=NlpSettings(tolerance=1e-11))
    applied = np.linspace(-0.4, 0.3, max(delay, 1))[:, None]
    plans = []
    for controller in (rti, nlp):
        controller.reset(applied=applied)
        plans.append(controller.step([0.3, -0.2], {"angle": 0.1}))
    ours, oracle = plans
    np.testing.assert_array_equal(ours.u.values[:delay], applied[:delay])
    assert relative(ours.x.values, oracle.x.values) < 1e-6
    assert relative(ours.u.values, oracle.u.values) < 1e-6


def test_each_iteration_on_frozen_data_gains_a_digit():
    problem, x, reference = car()
    target = rumo.RealTimeIteration(problem, sqp_iterations=100, tolerance=1e-12).step(x, reference).u.values
    errors = []
    for iterations in (1, 2, 3, 4):
        controller = rumo.RealTimeIteration(problem, sqp_iterations=iterations, tolerance=0.0)
        errors.append(relative(controller.step(x, reference).u.values, target))
    # From a resting guess with 3 kN of side force in it; later guesses are the last plan, shifted.
    assert all(later < 0.1 * earlier for earlier, later in pairwise(errors))
