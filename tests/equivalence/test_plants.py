"""A plant whose right-hand side is compiled goes where that of the portable core goes."""

import shutil

import casadi as ca
import numpy as np
import pytest

import rumo
from rumo.simulation import Plant
from rumo.textbook import robertson_dae

needs_cc = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler (cc) on this machine")


def turning():
    """Angles that go far, where the core takes the C library's functions, and kinks."""
    return rumo.Model(
        {"angle": "rad", "rate": "rad/s"},
        {"torque": "1/s^2"},
        lambda x, u, p: {"angle": x.rate, "rate": u.torque - 4.0 * ca.sin(x.angle) - ca.fmax(0.1 * x.rate, 0.2)},
        name="turning",
    )


@needs_cc
@pytest.mark.parametrize(
    ("model", "x", "push"),
    [(turning(), [0.3, 1.0], 1.0), (turning(), [3e6, 40.0], 1.0), (robertson_dae(), [0.8, 2e-5], 0.01)],
    ids=["near", "far", "algebraic"],
)
def test_compiled_and_portable(model, x, push, tmp_path_factory, monkeypatch):
    monkeypatch.setenv("RUMO_CACHE", str(tmp_path_factory.getbasetemp() / "plants"))
    plants = [Plant(model, 0.1, method="radau5", backend=backend) for backend in ("tailored", "portable")]
    assert [plant.backend for plant in plants] == ["tailored", "portable"]
    states, rng = [np.array(x), np.array(x)], np.random.default_rng(0)
    for _ in range(20):
        u = push * rng.normal(size=1)
        states = [
            plant.advance(state, u, model.default_parameters) for plant, state in zip(plants, states, strict=True)
        ]
        np.testing.assert_allclose(*states, rtol=1e-9, atol=1e-9)


def test_without_a_compiler_the_portable_core_integrates(tmp_path, monkeypatch):
    monkeypatch.setenv("RUMO_CACHE", str(tmp_path))
    monkeypatch.setenv("CC", str(tmp_path / "nothing"))
    model, x = turning(), np.array([0.2, 0.1])
    plant = Plant(model, 0.1, backend="tailored")
    assert plant.backend == "portable"
    end = plant.advance(x, np.zeros(1), model.default_parameters)
    np.testing.assert_array_equal(end, Plant(model, 0.1).advance(x, np.zeros(1), model.default_parameters))
