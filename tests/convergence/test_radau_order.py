"""The core's Radau method, told to take equal steps, converges with order 5, and its algebraic variables too."""

import numpy as np
import pytest
from test_orders import DURATION, INPUT, constrained, exact, fast_and_slow, fitted, swing

from rumo.kernel import Ending, Integrator, describe_system
from rumo.recording import system_program

STEPS = (6, 9, 13, 19)


def end_of(model, x, steps):
    """State after so many equal steps, and the algebraic variables there."""
    scales = np.full(len(model.variables), 1e-3)
    told = describe_system(system_program(model), scales, model.algebraic_guess, 1e-14, fixed_steps=steps)
    integrator, end, z = Integrator(told), np.empty(len(x)), np.empty(len(model.algebraic))
    ending = integrator.advance(np.array(x), np.array([INPUT]), model.default_parameters, DURATION, end)
    assert ending == Ending.ARRIVED
    assert integrator.work()["steps"] == steps
    integrator.algebraic(z)
    return end, z


@pytest.mark.parametrize("system", [swing, constrained])
def test_order(system):
    model, x, _ = system()
    target = exact(model, x)
    errors = [np.abs(end_of(model, x, n)[0] - target).max() for n in STEPS]
    assert fitted(STEPS, errors) == pytest.approx(5.0, abs=0.3), errors


def test_order_of_what_is_not_stiff():
    """Of a singularly perturbed system: the slow states keep the order, the fast one follows them."""
    model, x, checked = fast_and_slow()
    target = exact(model, x)
    errors = [np.abs(end_of(model, x, n)[0] - target)[:checked].max() for n in STEPS]
    assert fitted(STEPS, errors) == pytest.approx(5.0, abs=0.3), errors


def test_algebraic_equations_hold():
    model, x, _ = constrained()
    for n in STEPS:
        end, z = end_of(model, x, n)
        left = model.g(np.r_[end, z], [INPUT], model.default_parameters).full()
        assert np.abs(left).max() < 1e-12
