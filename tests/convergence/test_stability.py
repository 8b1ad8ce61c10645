"""What schemes do to a mode of rate lambda, against what they declare."""

import casadi as ca
import numpy as np
import pytest

from rumo.registry import DISCRETIZATIONS

FAST = -1e6


def growth(name, product):
    """End over beginning after one step of `xdot = lambda x`, for complex lambda times step."""
    # Two real states are one complex one.
    scheme, a, b = DISCRETIZATIONS[name](), product.real, product.imag
    xz, u, p = ca.SX.sym("x", 2), ca.SX.sym("u"), ca.SX.sym("p", 0)
    rate = ca.vertcat(a * xz[0] - b * xz[1], b * xz[0] + a * xz[1])

    class Mode:
        f = ca.Function("f", [xz, u, p], [rate])
        g = ca.Function("g", [xz, u, p], [ca.SX(0, 1)])

    inner = ca.SX.sym("e", len(scheme.inner(2, 0)))
    end = ca.SX.sym("end", 2)
    phi = scheme.residual(Mode, end, inner, ca.SX([1.0, 0.0]), u, p, 1.0)
    unknowns = ca.vertcat(end, inner)
    M, c = ca.Function("linear", [], [ca.jacobian(phi, unknowns), ca.substitute(phi, unknowns, 0)])().values()
    x, y = np.linalg.solve(M.full(), -c.full())[:2, 0]
    return complex(x, y)


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
    assert (max(*imaginary, *left) <= 1.0 + 1e-9) is DISCRETIZATIONS[name].a_stable


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
