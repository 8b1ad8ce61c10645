"""The core's integrator from Python: what it refuses, and what it says of its work."""

import numpy as np
import pytest
from problems import pendulum

import rumo
from rumo.kernel import Ending, Integrator, SystemProgram, can_integrate, describe_system
from rumo.kernel.tape import Tape
from rumo.recording import system_program
from rumo.textbook import heat_rod, robertson_dae


def told(model, **changes):
    values = {"scales": np.ones(len(model.variables)), "guess": model.algebraic_guess, "tolerance": 1e-9} | changes
    return describe_system(system_program(model), **values)


@pytest.mark.parametrize(
    ("member", "value", "message"),
    [
        ("tolerance", np.array([0.0]), "tolerance.0. is not positive"),
        ("tolerance", np.array([np.nan]), "tolerance.0. is not a finite number"),
        ("scales", np.array([1.0, -1.0]), "scales.1. is not positive"),
        ("J_first", 0, "J_first comes out of order"),
        ("J_first", 10**6, "J_first is out of range"),
        ("rates_registers", 0, "rates_code.0. is out of range"),
        ("fixed_steps", -1, "fixed_steps"),
        ("J_row", np.zeros(1, dtype=np.int32), "J_row"),
    ],
)
def test_descriptions_are_checked(member, value, message):
    with pytest.raises(ValueError, match=message):
        Integrator(told(pendulum().model) | {member: value})


@pytest.mark.parametrize("wrong", range(4))
def test_arrays_are_checked(wrong):
    arrays = [np.zeros(2), np.zeros(1), pendulum().model.default_parameters, np.zeros(2)]
    arrays[wrong] = np.zeros(9)
    x, u, p, end = arrays
    with pytest.raises(ValueError, match=r"expected . doubles"):
        Integrator(told(pendulum().model)).advance(x, u, p, 0.1, end)


def test_what_has_no_root_ends_with_that():
    """z^2 = -1 - x^2."""
    model = rumo.Model(
        {"x": "1"},
        {"u": "1"},
        lambda x, u, p: {"x": x.z + u.u},
        algebraic={"z": rumo.Algebraic("1", lambda x, u, p: x.z**2 + 1.0 + x.x**2, guess=3.0)},
    )
    end = np.zeros(1)
    assert Integrator(told(model)).advance(np.zeros(1), np.zeros(1), np.zeros(0), 0.1, end) == Ending.NO_ROOT
    with pytest.raises(rumo.PlantError, match="No algebraic variables were found"):
        rumo.Plant(model, 0.1, method="radau5").advance(np.zeros(1), np.zeros(1), np.zeros(0))


def test_a_linear_system_in_few_steps_with_few_jacobians():
    model, x = heat_rod(40), np.full(40, 25.0)
    integrator, u = Integrator(told(model)), np.zeros(len(model.inputs))
    for _ in range(50):
        assert integrator.advance(x, u, model.default_parameters, 5.0, x) == Ending.ARRIVED
    work = integrator.work()
    assert work["jacobians"] <= 4
    assert work["rejected"] <= 2
    assert 50 <= work["steps"] <= 120


def test_algebraic_variables_are_told_and_sought():
    model, z = robertson_dae(), np.zeros(1)
    integrator, x = Integrator(told(model)), np.array([0.7, 1e-5])
    integrator.algebraic(z)
    np.testing.assert_array_equal(z, model.algebraic_guess)
    integrator.seek(np.array([0.4]))
    assert integrator.advance(x, np.zeros(1), model.default_parameters, 0.1, x) == Ending.ARRIVED
    integrator.algebraic(z)
    assert x.sum() + z[0] == pytest.approx(1.0, abs=1e-12)
    integrator.reset()
    integrator.algebraic(z)
    np.testing.assert_array_equal(z, model.algebraic_guess)


def test_very_many_variables_that_all_depend_on_each_other_are_not_for_the_core():
    n = 1001
    everywhere = [(i, j) for i in range(n) for j in range(n)]
    program = SystemProgram(n, 0, 1, 0, Tape.empty(), Tape.empty(), np.zeros(n + len(everywhere)), everywhere)
    assert can_integrate(program) == f"its {n} variables depend on each other too closely"


@pytest.mark.parametrize("ending", Ending)
def test_every_ending_has_a_sentence(ending):
    assert ending.sentence.endswith(".")
