"""The magic formula: CommonRoad's, closed forms of peak, stiffness and load, and what no coefficients may break."""

from dataclasses import asdict, replace
from math import atan

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rumo
from rumo.vehicles import (
    COMMONROAD_3,
    PAPER_CAR,
    PASSENGER_CAR,
    TYRE_235_60_R16,
    MagicFormula,
    MagicFormulaCoefficients,
    TyreParameters,
    dynamic_bicycle,
)
from rumo.vehicles.tyres.magic_formula import LEAST_WEIGHT

COMMONROAD = PASSENGER_CAR.front.magic_formula
SHIFTS = ("p_hx1", "p_vx1", "p_hy1", "p_hy3", "p_vy1", "p_vy3", "r_hx1", "r_hy1", "r_by3", "r_vy1", "r_vy3")
SENSITIVE = replace(PASSENGER_CAR.front, magic_formula=TYRE_235_60_R16)


def forces(tyre, sigma, alpha, load, mu=None):
    """(F_x, F_y) [N] of numbers."""
    return MagicFormula().force(tyre, sigma, np.tan(alpha), load, tyre.mu if mu is None else mu)


def largest(tyre, load, mu=None):
    """Over slips, alone: along and across."""
    slips = np.r_[np.linspace(0.0, 0.4, 4001), 0.5, 1.0]
    return (
        max(forces(tyre, s, 0.0, load, mu)[0] for s in slips),
        max(forces(tyre, 0.0, a, load, mu)[1] for a in slips),
    )


def slopes(tyre, load, mu):
    sigma, tan_alpha = ca.SX.sym("sigma"), ca.SX.sym("tan_alpha")
    F_x, F_y = MagicFormula().force(tyre, sigma, tan_alpha, load, mu)
    at_zero = ca.Function("at_zero", [sigma, tan_alpha], [ca.jacobian(F_x, sigma), ca.jacobian(F_y, tan_alpha)])
    return [float(slope) for slope in at_zero(0.0, 0.0)]


@pytest.fixture(scope="module")
def theirs():
    """CommonRoad's tyre of vehicle 2, without shifts: (sigma, alpha, load) -> forces, and what of them is weight."""
    model = pytest.importorskip("vehiclemodels.utils.tire_model")
    tyre = pytest.importorskip("vehiclemodels.parameters_vehicle2").parameters_vehicle2().tire
    for name in SHIFTS:
        setattr(tyre, name, 0.0)

    def combined(sigma, alpha, load):
        # Their slips and forces count the other way: slip ratio and slip angle of a braked wheel are positive.
        F_x0, (F_y0, mu_y) = (
            model.formula_longitudinal(-sigma, 0.0, load, tyre),
            model.formula_lateral(-alpha, 0.0, load, tyre),
        )
        F_x = model.formula_longitudinal_comb(-sigma, -alpha, F_x0, tyre)
        return (F_x, model.formula_lateral_comb(-sigma, -alpha, 0.0, mu_y, load, F_y0, tyre)), (F_x0, F_y0)

    return combined


@pytest.mark.parametrize("load", [800.0, 2958.0, 9000.0])
def test_it_is_that_of_commonroad_until_its_weights_fall_below_zero(theirs, load):
    compared = 0
    for sigma in (-1.0, -0.3, -0.05, -0.002, 0.01, 0.08, 0.4, 3.0):
        for alpha in (-1.2, -0.3, -0.1, -0.01, 0.003, 0.06, 0.2, 0.6):
            expected, pure = theirs(sigma, alpha, load)
            ours = forces(PASSENGER_CAR.front, sigma, alpha, load)
            for force, other, unweighted in zip(ours, expected, pure, strict=True):
                if other / unweighted > LEAST_WEIGHT:
                    assert force == pytest.approx(other, rel=1e-12)
                    compared += 1
                else:
                    assert 0.0 <= force / unweighted < LEAST_WEIGHT
    assert compared > 100


@pytest.mark.parametrize("tyre", [PASSENGER_CAR.front, SENSITIVE, COMMONROAD_3.rear])
@pytest.mark.parametrize("load", [1500.0, 4850.0, 9000.0])
@pytest.mark.parametrize("mu", [1.0489, 0.3])
def test_peak_and_stiffness_are_those_of_the_coefficients(tyre, load, mu):
    c, df = tyre.magic_formula, load / tyre.magic_formula.F_z0 - 1.0
    peak = [friction * load * mu / tyre.mu for friction in (c.p_Dx1 + c.p_Dx2 * df, c.p_Dy1 + c.p_Dy2 * df)]
    np.testing.assert_allclose(largest(tyre, load, mu), peak, rtol=1e-4)
    K_x = load * c.p_Kx1 * np.exp(c.p_Kx3 * df)
    K_y = c.p_Ky1 * (c.F_z0 * np.sin(2.0 * atan(load / (c.p_Ky2 * c.F_z0))) if c.p_Ky2 else load)
    np.testing.assert_allclose(slopes(tyre, load, mu), [K_x, K_y], rtol=1e-12)


@pytest.mark.parametrize("mu", [0.05, 0.3, 1.3])
def test_on_any_road_the_largest_force_is_as_much_of_friction(mu):
    q, load = mu / SENSITIVE.mu, 3000.0
    grid = [(s, a) for s in np.linspace(-0.4, 0.4, 21) for a in np.linspace(0.0, 0.4, 11)]
    dry = np.array([forces(SENSITIVE, s, a, load) for s, a in grid])
    wet = np.array([forces(SENSITIVE, q * s, q * a, load, mu) for s, a in grid])
    np.testing.assert_allclose(wet, q * dry, rtol=1e-12, atol=1e-12)


def test_friction_falls_and_stiffness_saturates_with_the_load():
    c = TYRE_235_60_R16
    light, heavy = largest(SENSITIVE, c.F_z0), largest(SENSITIVE, 2.0 * c.F_z0)
    assert heavy[0] / light[0] == pytest.approx(2.0 * (1.0 - 0.16395 / 1.1739), rel=1e-4)
    assert heavy[1] / light[1] == pytest.approx(2.0 * (1.0 - 0.18033 / 1.0489), rel=1e-4)
    loads = np.linspace(0.5, 4.0, 701) * c.F_z0
    stiffness = [c.stiffnesses(load)[1] for load in loads]
    assert loads[int(np.argmax(stiffness))] / c.F_z0 == pytest.approx(c.p_Ky2, abs=0.01)
    assert max(stiffness) == pytest.approx(c.p_Ky1 * c.F_z0, rel=1e-5)
    # An axle that rolls puts weight from one tyre onto the other, and has less of both.
    assert sum(c.peaks(load)[1] for load in (1000.0, 5000.0)) < 2.0 * c.peaks(3000.0)[1]
    assert sum(c.stiffnesses(load)[1] for load in (1000.0, 5000.0)) < 2.0 * c.stiffnesses(3000.0)[1]


@pytest.mark.parametrize("load", [1.0, 1e5, 1e7])
def test_loads_beyond_any_fit_leave_some_friction(load):
    peaks = np.array(TYRE_235_60_R16.peaks(load))
    assert (peaks >= np.array([0.1 * 1.1739, 0.1 * 1.0489]) * load).all()
    for s in (0.01, 1.0):
        pure = np.array([forces(SENSITIVE, s, 0.0, load)[0], forces(SENSITIVE, 0.0, s, load)[1]])
        assert (pure > 0.0).all()
        assert (pure <= peaks).all()


COEFFICIENTS = {
    **dict.fromkeys(("p_Cx1", "p_Cy1"), st.floats(1.0, 2.0)),
    **dict.fromkeys(("p_Dx1", "p_Dy1"), st.floats(0.3, 2.0)),
    **dict.fromkeys(("p_Ex1", "p_Ey1", "r_Ex1", "r_Ey1"), st.floats(-3.0, 1.0)),
    **dict.fromkeys(("p_Kx1", "p_Ky1"), st.floats(3.0, 60.0)),
    **dict.fromkeys(("r_Bx1", "r_By1"), st.floats(1.0, 20.0)),
    **dict.fromkeys(("r_Bx2", "r_By2"), st.floats(-20.0, 20.0)),
    **dict.fromkeys(("r_Cx1", "r_Cy1"), st.floats(0.5, 1.5)),
    **dict.fromkeys(("p_Dx2", "p_Dy2", "p_Kx3"), st.floats(-0.5, 0.3)),
    "p_Ky2": st.one_of(st.just(0.0), st.floats(0.5, 3.0)),
    "F_z0": st.floats(500.0, 8000.0),
}
KINKED = st.one_of(st.just(0.0), st.floats(-5.0, 5.0))


@given(
    coefficients=st.fixed_dictionaries(COEFFICIENTS).map(lambda values: MagicFormulaCoefficients(**values)),
    sigma=KINKED,
    tan_alpha=KINKED,
    load=st.floats(10.0, 2e4),
    mu=st.floats(0.05, 1.5),
)
@settings(deadline=None, max_examples=150)
def test_any_tyre_opposes_sliding_within_its_peaks(coefficients, sigma, tan_alpha, load, mu):
    tyre = TyreParameters(C_s=1e4, C_a=1e4, mu=0.8, magic_formula=coefficients)
    slips = ca.SX.sym("slips", 2)
    F = ca.vertcat(*MagicFormula().force(tyre, slips[0], slips[1], load, mu))
    force, slope = (entry.full() for entry in ca.Function("F", [slips], [F, ca.jacobian(F, slips)])([sigma, tan_alpha]))
    peaks = np.array(coefficients.peaks(load)) * mu / 0.8
    assert (np.abs(force.ravel()) <= peaks * (1.0 + 1e-12)).all()
    assert (force.ravel() * [sigma, tan_alpha] >= -1e-12 * peaks).all()
    assert np.isfinite(slope).all()


def test_a_tyre_without_coefficients_is_refused():
    with pytest.raises(rumo.ArgumentError, match=r"tyre: got MagicFormula\(\) of a tyre without coefficients"):
        dynamic_bicycle(PAPER_CAR, MagicFormula())


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("p_Cx1", 2.1, r"MagicFormulaCoefficients.p_Cx1: got 2.1, expected at most 2"),
        ("p_Ey1", 1.5, r"MagicFormulaCoefficients.p_Ey1: got 1.5, expected at most 1"),
        ("p_Ky1", -21.92, r"p_Ky1: got -21.92, expected a positive number. Here a positive slip angle pushes left"),
        ("p_Ky2", -1.0, r"p_Ky2: got -1.0, expected a number of at least 0"),
        ("r_Bx1", 0.0, r"r_Bx1: got 0.0, expected a positive finite number"),
        ("p_Dx2", np.nan, r"p_Dx2: got nan, expected a finite number"),
        ("F_z0", "4850", r"F_z0: got '4850', expected a finite number"),
    ],
)
def test_coefficients_that_cannot_be(name, value, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        MagicFormulaCoefficients(**{**asdict(COMMONROAD), name: value})
