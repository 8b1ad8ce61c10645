"""Integration over a sample: of smooth equations, and of those that jump."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import rumo
from rumo.simulation.plants.integration import integrated


def test_stiff_equations_against_another_method():
    def rates(x):  # Robertson's reaction
        a, b, c = x
        return [-0.04 * a + 1e4 * b * c, 0.04 * a - 1e4 * b * c - 3e7 * b**2, 3e7 * b**2]

    start = np.array([1.0, 0.0, 0.0])
    other = solve_ivp(lambda t, x: rates(x), (0.0, 5.0), start, method="Radau", rtol=1e-10, atol=1e-12).y[:, -1]
    np.testing.assert_allclose(integrated(rates, start, 5.0, 1e-9), other, atol=1e-7)


def test_a_solution_slides_along_a_jump():
    """By Filippov: 11 of 20 parts of the time above, which the second state counts."""

    def rates(x):
        above = x[0] > 0.0
        return [-900.0 if above else 1100.0, 1.0 if above else 0.0]

    end = integrated(rates, np.array([0.0, 0.0]), 0.04, 1e-8)
    assert abs(end[0]) < 0.02
    assert end[1] == pytest.approx(0.04 * 11.0 / 20.0, abs=2e-5)


@pytest.mark.parametrize("rates", [lambda x: [1.0 / (x[0] - x[0])], lambda x: [math.sqrt(-x[0])]])
def test_equations_without_a_value_are_an_error_of_the_plant(rates):
    with pytest.raises(rumo.PlantError, match=r"no value within the sample that begins at x = \[1.0\]"):
        integrated(rates, np.array([1.0]), 0.04, 1e-8)
