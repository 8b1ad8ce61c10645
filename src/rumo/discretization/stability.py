"""What a scheme makes of a mode, and how many substeps keep an explicit one stable."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from rumo.discretization.base import Discretization
from rumo.model import Model
from rumo.signals import Array, NamedSymbols

# A mode grows if it is more than this much larger after a substep.
GROWTH = 1e-9


def modes(model: Model, xz: Array, u: Array, p: Array) -> np.ndarray:
    """Rates lambda [1/s] of the model's modes (n, nx), at states and algebraic variables (n, nx + nz).

    Eigenvalues of its Jacobian; inputs (n, nu) and parameters (n, np_) or (np_,).
    """
    jacobian, parameters = model.jacobian(), np.broadcast_to(p, (len(xz), len(model.parameters)))
    points = zip(xz, u, parameters, strict=True)
    return np.array([np.linalg.eigvals(jacobian(*point).full()) for point in points], dtype=complex)


def growth(scheme: Discretization, products: Sequence[complex]) -> np.ndarray:
    """End over beginning of a mode `xdot = lambda x` after one substep, for each product of lambda and step.

    The stability function R of the scheme, complex.
    """

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


def stable_substeps(scheme: Discretization, products: Sequence[complex]) -> int:
    """The smallest number of substeps with which no decaying mode grows, from products of lambda and interval."""
    decaying = np.array([product for product in products if product.real < 0.0], dtype=complex)

    def stable(substeps: int) -> bool:
        return bool((np.abs(growth(scheme, (decaying / substeps).tolist())) <= 1.0 + GROWTH).all())

    if scheme.a_stable or not len(decaying):
        return 1
    few, many = 0, 1
    while not stable(many):
        few, many = many, 2 * many
    while many - few > 1:
        middle = (few + many) // 2
        few, many = (few, middle) if stable(middle) else (middle, many)
    return many
