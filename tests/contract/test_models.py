"""What holds for every model that comes with Rumo."""

import casadi as ca
import numpy as np
import pytest

import rumo
from rumo import textbook, vehicles
from rumo.registry import MODELS

every_model = pytest.mark.parametrize("name", MODELS)

NATURAL = {
    "dynamic_bicycle": {"v_x": 8.0, "w_f": 13.3, "w_r": 13.3},
    "four_wheel": {"v_x": 8.0, "w_fl": 13.3, "w_fr": 13.3, "w_rl": 13.3, "w_rr": 13.3},
    "cart_pendulum": {"angle": 0.3, "speed": 0.1},
    "robertson_reactor": {"a": 0.8, "b": 2e-5, "c": 0.2},
    "robertson_dae": {"a": 0.8, "b": 2e-5, "c": 0.2},
    "van_der_pol": {"position": 1.5, "speed": -1.2},
    "heat_rod": {f"t_{i}": 20.0 + 5.0 * i for i in range(1, 9)},
    "tubular_reactor": {f"c_{i}": 4000.0 for i in range(1, 6)} | {f"t_{i}": 72.0 for i in range(1, 6)},
    "mass_chain": {"x_1": 0.5, "v_1": 0.2, "x_12": -0.3},
    "gas_pipeline": {f"p_{i}": 62.0 - 2.0 * i for i in range(1, 7)} | {f"q_{i}": 60.0 for i in range(1, 7)},
    "van_de_vusse_reactor": {"c_a": 2.14, "c_b": 1.09, "temperature": 114.2, "jacket": 112.9},
}


def points(name):
    """Variables (nx + nz,): zero, natural ones, and natural ones with some scatter."""
    model = MODELS[name]()
    natural = model.variables.vector(NATURAL[name], "x", np.zeros(len(model.variables)))
    scatter = np.random.default_rng(0).uniform(0.9, 1.1, (5, len(natural)))
    return model, np.vstack([np.zeros_like(natural), natural, natural * scatter])


@every_model
def test_name_is_the_registered_one(name):
    assert MODELS[name]().name == name


@every_model
def test_public_factory_is_documented(name):
    factory = getattr(vehicles, name, None) or getattr(textbook, name)
    summary, _, rest = factory.__doc__.partition("\n\n")
    assert summary.endswith(".")
    assert "States" in rest


@every_model
def test_every_signal_has_a_unit(name):
    model = MODELS[name]()
    for signals in model.signals:
        assert all(unit and unit == unit.strip() for unit in signals.units)
        assert all(model.unit(signal) for signal in signals)


@every_model
def test_has_states_and_inputs_in_vector_order(name):
    model = MODELS[name]()
    assert model.f.size1_in(0) == len(model.states) + len(model.algebraic)
    assert model.f.size1_out(0) == len(model.states) > 0
    assert model.g.size1_out(0) == len(model.algebraic)
    assert model.f.size1_in(1) == len(model.inputs) > 0
    assert model.f.size1_in(2) == len(model.parameters)
    assert [model.f.name_in(i) for i in range(3)] == ["x", "u", "p"]


@every_model
def test_dynamics_and_derivatives_are_finite(name):
    model, states = points(name)
    arguments = [model.xz, model.u, model.p]
    equations = ca.vertcat(model.f(*arguments), model.g(*arguments))
    slopes = ca.Function("slopes", arguments, [ca.jacobian(equations, ca.vertcat(model.xz, model.u))])
    for x in states:
        for function in (model.f, model.g, slopes):
            assert np.isfinite(function(x, np.zeros(len(model.inputs)), model.default_parameters).full()).all()


@every_model
def test_default_parameters_are_finite(name):
    assert np.isfinite(MODELS[name]().default_parameters).all()


@every_model
def test_outputs_are_finite(name):
    model, states = points(name)
    for output in model.outputs:
        value = ca.Function("output", [model.xz, model.u, model.p], [model.expression(output, "output")])
        for x in states:
            assert np.isfinite(float(value(x, np.zeros(len(model.inputs)), model.default_parameters)))


@every_model
def test_every_input_acts(name):
    model = MODELS[name]()
    pattern = ca.jacobian_sparsity(model.f(model.xz, model.u, model.p), model.u)
    # Zero columns would be inputs that nothing listens to.
    assert (ca.DM(pattern, 1).full() != 0.0).any(axis=0).all()


@every_model
def test_two_instances_are_equal_and_independent(name):
    first, second = MODELS[name](), MODELS[name]()
    _, states = points(name)
    assert first.states.names == second.states.names
    for x in states:
        arguments = x, np.ones(len(first.inputs)), first.default_parameters
        np.testing.assert_array_equal(first.f(*arguments).full(), second.f(*arguments).full())


@every_model
def test_can_be_integrated(name):
    model, states = points(name)
    plant = rumo.simulation.Plant(model, 0.01)
    end = plant.advance(states[1][: len(model.states)], np.zeros(len(model.inputs)), model.default_parameters)
    assert np.isfinite(end).all()
