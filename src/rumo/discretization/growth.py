"""Unstable modes that a scheme predicts to decay.

Implicit schemes damp what is fast, also where it should grow: implicit Euler takes a mode `xdot = lambda x` with
`lambda h = 3` for one that halves and changes sign.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rumo.discretization.base import Discretization
from rumo.discretization.gauss2 import Gauss2
from rumo.discretization.radau2 import Radau2
from rumo.discretization.radau3 import Radau3
from rumo.discretization.stability import spectra, stability_function
from rumo.signals import Array

MATTERS = np.log(2.0)
"""Growth over the horizon, as a logarithm, below which nobody would call a mode unstable."""
CONTROLLABLE = np.log(1e8)
"""Growth over an interval, as a logarithm, beyond which no input held for so long could hold a mode: what grows like
that is a jump to another state, which an implicit scheme rightly passes over."""
NOISE = 1e4 * np.finfo(float).eps
"""Of an eigenvalue, over the size of its matrix times the eigenvalue's condition."""
TAKES_PART = 0.3
"""Of the largest participation."""
LEFT = 0.5
"""Of a mode, by a feedback that should have brought it to rest within an interval: what a cure may leave."""
NEARLY_REAL = 0.01
"""Of a mode's rate times the interval, the imaginary part of one that does not turn."""
LARGEST = 700.0
"""Exponent of a number that floats can be."""
MOST_SUBSTEPS = 1000
NUDGE = 1e-9
"""Away from poles, relative."""


@dataclass(frozen=True)
class MisjudgedMode:
    """An unstable mode that decays, or changes its sign, in a prediction.

    Attributes
    ----------
    states : tuple of str
        Those that take part most, the first foremost.
    rate : complex
        The eigenvalue [1/s], its real part positive.
    stage : int
        1 to N: the interval in which it is misjudged most.
    step : float
        That interval's length [s].
    factor : complex
        By what the scheme multiplies the mode over the interval.
    """

    states: tuple[str, ...]
    rate: complex
    stage: int
    step: float
    factor: complex

    def described(self, scheme: Discretization) -> str:
        """In words, with the cure."""
        period = f", with a period of {2.0 * np.pi / abs(self.rate.imag):.2g} s" if self.rate.imag else ""
        growth = np.exp(min(self.rate.real * self.step, LARGEST))
        size = float(f"{abs(self.factor) if self.rate.imag else self.factor.real:.2g}")
        believed = "decays" if abs(size) < 1.0 else "changes its sign" if size < 0.0 else "grows like that"
        believed = "stays as it is" if size == 1.0 else believed
        ways = "".join(f"{way!r} or " for way in cures(scheme, self.rate * self.step))
        return (
            f"{' and '.join(self.states)} {'has' if len(self.states) == 1 else 'have'} an unstable mode with a time "
            f"constant of {1.0 / self.rate.real:.2g} s{period}: over the interval of {self.step:.3g} s before stage "
            f"{self.stage} it grows to {growth:.2g} times what it was. {scheme!r} predicts {size:g} times: plans "
            f"believe that it {believed}, and do not hold it. Take {ways}shorter intervals."
        )


def misjudged_mode(
    scheme: Discretization,
    jacobians: Array,
    steps: Array,
    states: Sequence[str],
    intervals: np.ndarray | None = None,
    horizon: float | None = None,
    inputs: int = 1,
) -> MisjudgedMode | None:
    """The unstable mode that a scheme misjudges most, of those that an input could hold.

    Parameters
    ----------
    scheme : Discretization
        Of the prediction.
    jacobians : ndarray, shape (n, nx, nx)
        Of the model [1/s]; NaN where it has none.
    steps : ndarray, shape (n,)
        Lengths of intervals [s].
    states : sequence of str
        Names (nx,).
    intervals : ndarray of int, shape (n,), optional
        Which intervals of a horizon of so many seconds these are; all of them if not given.
    horizon : float, optional
        Its length [s].
    inputs : int
        Of the model: two hold within an interval a mode that turns, which takes one input two.
    """
    rates: Any = np.nan_to_num(spectra(jacobians))
    products, length = rates * steps[:, None], steps.sum() if horizon is None else horizon
    wrong = _concerns(scheme, products, rates.real * length, inputs)
    worst = np.where(wrong, products.real, 0.0).max(axis=1)
    for k in np.argsort(-worst, kind="stable")[: np.count_nonzero(worst)].tolist():
        mode = _named(scheme, jacobians[k], length, float(steps[k]), states, inputs)
        if mode is not None:
            return replace(mode, stage=1 + (k if intervals is None else int(intervals[k])))
    return None


def _concerns(scheme: Discretization, products: Any, growth: Any, inputs: int) -> np.ndarray:
    """Whether modes are misjudged, and matter with their growth over the horizon, a logarithm."""
    return (growth > MATTERS) & (products.real <= CONTROLLABLE) & is_misjudged(scheme, products, inputs)


def is_misjudged(scheme: Discretization, products: Any, inputs: int = 1) -> np.ndarray:
    """Whether modes grow, by products of rate and interval, but decay in the prediction, or cannot be held by it.

    With R what the scheme multiplies a mode by over an interval, a feedback that should bring it to rest within one
    leaves `(R - exp(z)) / (R - 1)` of it: more than all where R < 0, as implicit Euler's is beyond z = 1. One that
    turns is judged with its conjugate where a single input has to hold both; more inputs are taken to hold both within
    an interval. An explicit scheme's growth is not judged: with it, a model may well be meant as one in discrete time.
    """
    factors = interval_factors(scheme, products)
    lost = np.abs(factors) < 1.0
    if not scheme.explicit:
        lost |= _left(factors, products, inputs) >= 1.0
    return (products.real > 0.0) & lost


def _left(factors: Any, products: Any, inputs: int = 1) -> Any:
    """What is left of modes by a feedback that should have brought them to rest.

    The feedback is made for what the scheme predicts. Of a real mode it is what is left after an interval, and of a
    complex one too where there is more than one input. One input takes it and its conjugate two intervals: what is left
    is the spectral radius of that loop (Ackermann's formula).
    """
    exact = np.exp(np.minimum(products.real, LARGEST) + 1j * products.imag)
    with np.errstate(all="ignore"):
        real = np.abs(factors - exact) / np.abs(factors - 1.0)
        pull = factors**2 * (exact - 1.0) / (factors - 1.0)  # by the input, over what is predicted of it
        mean = exact.real - 0.5 * pull.imag / factors.imag
        product = np.abs(exact) ** 2 - (exact.conj() * pull).imag / factors.imag
        apart = np.sqrt(mean**2 - product + 0j)
        pair = np.maximum(np.abs(mean + apart), np.abs(mean - apart))
    return np.where((np.abs(products.imag) < NEARLY_REAL) | (inputs > 1), real, np.nan_to_num(pair, nan=np.inf))


def interval_factors(scheme: Discretization, products: np.ndarray) -> np.ndarray:
    """What a scheme multiplies modes by over an interval, from products of rate and interval of any shape."""
    parts = (1.0 + NUDGE) * products.ravel() / scheme.substeps
    with np.errstate(over="ignore", invalid="ignore"):
        return (stability_function(scheme, parts.tolist()) ** scheme.substeps).reshape(products.shape)


def cures(scheme: Discretization, product: complex) -> list[Discretization]:
    """Schemes that predict a mode, by the product of rate and interval, well enough to hold it: finer, and better."""
    doubled = (scheme.substeps * 2**k for k in range(1, 20))
    finer = (replace(scheme, substeps=m) for m in doubled if m <= MOST_SUBSTEPS)
    better = (other(scheme.substeps) for other in (Radau2, Radau3, Gauss2) if not isinstance(scheme, other))
    found = (next((way for way in ways if _judges(way, product)), None) for ways in (finer, better))
    return [way for way in found if way is not None]


def _judges(scheme: Discretization, product: complex) -> bool:
    products = np.array([product])
    factors = interval_factors(scheme, products)
    return bool((np.abs(factors) > 1.0).all() and (_left(factors, products) <= LEFT).all())


def _named(
    scheme: Discretization, J: Array, horizon: float, step: float, states: Sequence[str], inputs: int
) -> MisjudgedMode | None:
    """The mode of a Jacobian (nx, nx) that is misjudged and grows fastest; None if that is rounding."""
    rates: Any
    rates, right = np.linalg.eig(J)
    try:
        left = np.linalg.inv(right)
    except np.linalg.LinAlgError:
        return None
    with np.errstate(over="ignore"):  # modes that are nearly one
        condition = np.linalg.norm(right, axis=0) * np.linalg.norm(left, axis=1)
    known = rates.real > NOISE * np.linalg.norm(J) * condition
    found = np.flatnonzero(known & _concerns(scheme, rates * step, rates.real * horizon, inputs))
    if not len(found):
        return None
    i = int(found[np.argmax(rates[found].real)])
    # Participation (Perez-Arriaga et al., 1982): how much of a state is this mode, whatever the units.
    part = np.abs(right[:, i] * left[i])
    order = [int(j) for j in np.argsort(-part, kind="stable") if part[j] >= TAKES_PART * part.max()]
    rate = complex(rates[i])
    factor = complex(interval_factors(scheme, np.array([rate * step]))[0])
    return MisjudgedMode(tuple(states[j] for j in order[:3]), rate, 1, step, factor)
