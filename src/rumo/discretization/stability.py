"""What a scheme makes of a mode, and how many substeps keep an explicit one stable."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np

from rumo.discretization.base import Discretization
from rumo.model import Model
from rumo.signals import Array, NamedSymbols

# A mode grows if it is more than this much larger after a substep.
GROWTH = 1e-9
SMALL = -1e-4
"""A product of rate and step at which a scheme shows its order."""
PRECISION = 1e-7
"""Of a stable step, relative."""


def eigenvalues(model: Model, xz: Array, u: Array, p: Array) -> np.ndarray:
    """Eigenvalues lambda [1/s] of a model's Jacobian (n, nx), complex; see `jacobians`."""
    return spectra(jacobians(model, xz, u, p))


def jacobians(model: Model, xz: Array, u: Array, p: Array) -> Array:
    """Derivatives of a model's rates by its states (n, nx, nx) [1/s], algebraic variables eliminated.

    At states and algebraic variables (n, nx + nz), inputs (n, nu), parameters (n, np_) or (np_,); NaN where the model
    or its derivatives have no value.
    """
    jacobian, parameters = model.jacobian(), np.broadcast_to(p, (len(xz), len(model.parameters)))
    return np.array([jacobian(*point).full() for point in zip(xz, u, parameters, strict=True)])


def spectra(matrices: Array) -> np.ndarray:
    """Eigenvalues (n, nx) of matrices (n, nx, nx), complex; NaN where one is not finite."""
    nothing = np.full(matrices.shape[1], np.nan)
    return np.array([np.linalg.eigvals(A) if np.isfinite(A).all() else nothing for A in matrices], dtype=complex)


def stability_function(scheme: Discretization, products: Sequence[complex]) -> np.ndarray:
    """R(z), complex: end over beginning of a mode `xdot = lambda x` after one substep h, for each z = lambda h."""

    def rates(x: NamedSymbols, u: NamedSymbols, p: NamedSymbols) -> dict[str, object]:
        # Two real states are one complex one; the rate is an input, so that one function does for all.
        return {"real": u.decay * x.real - u.turn * x.imaginary, "imaginary": u.turn * x.real + u.decay * x.imaginary}

    mode = Model({"real": "1", "imaginary": "1"}, {"decay": "1", "turn": "1"}, rates, name="mode")
    end, inner = ca.SX.sym("end", 2), ca.SX.sym("inner", len(scheme.inner(2, 0)))
    unknowns = ca.vertcat(end, inner)
    phi = scheme.residual(mode, end, inner, ca.SX([1.0, 0.0]), mode.u, mode.p, 1.0)
    linear = ca.Function("linear", [mode.u], [ca.jacobian(phi, unknowns), ca.substitute(phi, unknowns, 0.0)])
    n, size = len(products), phi.numel()
    M, constant = linear.map(n)(np.array([(product.real, product.imag) for product in products]).T)
    # Matrices side by side.
    matrices, right = M.full().reshape(size, n, size).transpose(1, 0, 2), -constant.full().T[:, :, None]
    ends = np.linalg.solve(matrices, right)[:, :2, 0]
    return ends[:, 0] + 1j * ends[:, 1]


def lead(scheme: Discretization) -> float:
    """Error of a step h of a whole interval over h^2 x'': 1/2 of the implicit Euler method, 0 beyond first order."""
    if scheme.order > 1:
        return 0.0
    end = stability_function(scheme, [SMALL])[0].real
    return float((end - np.exp(SMALL)) / SMALL**2 / scheme.substeps)


def stable_step(scheme: Discretization, rates: Sequence[complex]) -> float:
    """The largest substep [s] with which no mode of these rates [1/s] grows that should decay; infinite if any is."""
    decaying: Any = np.array([rate for rate in rates if rate.real < 0.0], dtype=complex)

    def stable(step: float) -> bool:
        return bool((np.abs(stability_function(scheme, (decaying * step).tolist())) <= 1.0 + GROWTH).all())

    if scheme.a_stable or not len(decaying):
        return np.inf
    step = 1.0 / np.abs(decaying).max()  # of all explicit schemes' order of magnitude
    while not stable(step):
        step /= 2.0
    while stable(2.0 * step):
        step *= 2.0
    beyond = 2.0 * step
    while beyond - step > PRECISION * step:
        middle = (step + beyond) / 2.0
        step, beyond = (middle, beyond) if stable(middle) else (step, middle)
    return step


def stable_substeps(scheme: Discretization, products: Sequence[complex]) -> int:
    """The smallest number of substeps with which no mode grows, from products of rates and interval."""
    return max(1, int(np.ceil((1.0 - PRECISION) / stable_step(scheme, products))))
