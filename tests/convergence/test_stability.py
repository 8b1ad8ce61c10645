"""What schemes do to a mode of rate lambda, against what they declare."""

import numpy as np
import pytest

from rumo.discretization.stability import stability_function, stable_step, stable_substeps
from rumo.registry import DISCRETIZATIONS

FAST = -1e6


def growth(name, product):
    return stability_function(DISCRETIZATIONS[name](), [product])[0]


@pytest.mark.parametrize("name", DISCRETIZATIONS)
def test_fast_modes(name):
    scheme, factor = DISCRETIZATIONS[name], abs(growth(name, complex(FAST)))
    if scheme.l_stable:
        assert factor < 1e-3
    elif scheme.a_stable:
        # The fast mode neither grows nor goes: it changes sign, or stays, from step to step.
        assert factor == pytest.approx(1.0, abs=1e-4)
    else:
        assert factor > 1e5


@pytest.mark.parametrize("name", DISCRETIZATIONS)
def test_a_stability(name):
    imaginary = [abs(growth(name, complex(0.0, y))) for y in np.r_[0.01, 0.1:20.0:0.37, 1e2, 1e4]]
    left = [abs(growth(name, complex(x, y))) for x in (-0.1, -3.0, -50.0) for y in (0.0, 1.0, 30.0)]
    assert bool(max(*imaginary, *left) <= 1.0 + 1e-9) is DISCRETIZATIONS[name].a_stable


@pytest.mark.parametrize("name", DISCRETIZATIONS)
def test_slow_modes_are_those_of_the_exponential(name):
    scheme = DISCRETIZATIONS[name]
    for product in (-0.02 + 0.0j, 0.01 + 0.02j):
        assert abs(growth(name, product) - np.exp(product)) < abs(product) ** (scheme.order + 1)


@pytest.mark.parametrize("name", DISCRETIZATIONS)
def test_declared(name):
    scheme = DISCRETIZATIONS[name]
    assert scheme.a_stable or not scheme.l_stable
    assert not (scheme.explicit and scheme.a_stable)
    assert scheme.__doc__
    assert scheme.__doc__.splitlines()[0].endswith(".")


def test_stability_functions_in_closed_form():
    z = 0.7 * np.exp(2.3j)
    closed = {
        "implicit-euler": 1.0 / (1.0 - z),
        "explicit-euler": 1.0 + z,
        "implicit-midpoint": (1.0 + z / 2.0) / (1.0 - z / 2.0),
        "trapezoidal": (1.0 + z / 2.0) / (1.0 - z / 2.0),
        "rk4": 1.0 + z + z**2 / 2.0 + z**3 / 6.0 + z**4 / 24.0,
        # Hairer and Wanner (1996), table IV.3.1 and (IV.3.30): Pade approximants.
        "gauss2": (1.0 + z / 2.0 + z**2 / 12.0) / (1.0 - z / 2.0 + z**2 / 12.0),
        "radau2": (1.0 + z / 3.0) / (1.0 - 2.0 * z / 3.0 + z**2 / 6.0),
        "radau3": (1.0 + 2.0 * z / 5.0 + z**2 / 20.0) / (1.0 - 3.0 * z / 5.0 + 3.0 * z**2 / 20.0 - z**3 / 60.0),
    }
    for name, value in closed.items():
        assert growth(name, z) == pytest.approx(value, rel=1e-12), name


@pytest.mark.parametrize(("name", "limit"), [("explicit-euler", 2.0), ("rk4", 2.785293563405282)])
def test_substeps_of_explicit_schemes(name, limit):
    for product in (0.5, 30.0, 4.4e4):
        scheme = DISCRETIZATIONS[name]()
        assert stable_substeps(scheme, [-product + 0.0j, 5.0 + 0.0j]) == int(np.ceil(product / limit))


def test_implicit_schemes_need_no_substeps_and_undamped_modes_few():
    assert stable_substeps(DISCRETIZATIONS["radau2"](), [FAST + 0.0j]) == 1
    # A mode that hardly decays: explicit Euler needs |1 + z / m| <= 1.
    assert stable_substeps(DISCRETIZATIONS["explicit-euler"](), [-0.1 + 2.0j]) == 21


def test_largest_stable_step():
    rk4, euler = DISCRETIZATIONS["rk4"](), DISCRETIZATIONS["explicit-euler"]()
    assert stable_step(rk4, [-0.034 + 0.0j, -0.001 + 0.0j]) == pytest.approx(2.785293563405282 / 0.034, rel=1e-6)
    assert stable_step(euler, [-0.1 + 2.0j]) == pytest.approx(0.2 / (0.01 + 4.0), rel=1e-6)
    assert stable_step(euler, [1.0 + 0.0j]) == np.inf
    assert stable_step(DISCRETIZATIONS["gauss2"](), [FAST + 0.0j]) == np.inf
