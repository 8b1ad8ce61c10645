"""What a step of the filter is made of, and who computes it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from rumo.signals import Array


@dataclass(frozen=True, eq=False)
class FilterNumbers:
    """What a filter is told of its states x (n,) and measurements (m,).

    Attributes
    ----------
    noise : ndarray, shape (m,)
        Variance of each measurement.
    process : ndarray, shape (n,)
        Variance of what the model misses of each state in one sample.
    floor : ndarray, shape (n,)
        Below which no predicted variance falls.
    turn : ndarray, shape (m,)
        What is no difference in a measurement: 2 pi for angles, 0 for others.
    width : float
        Of the gate in standard deviations; infinite for none.
    patience : int
        Refusals of a measurement in a row until it is believed again.
    """

    noise: Array
    process: Array
    floor: Array
    turn: Array
    width: float
    patience: int


class FilterEngine(Protocol):
    """Steps from one belief to the next.

    A belief is an array (n + n n + m,): state, a factor of its covariance in a form of the engine's own, and for each
    measurement how many were refused in a row. A report is (3 m + 2,): innovations, their deviations, which were used
    (1, else 0), the normalised innovation squared of these, and the logarithm of their covariance's determinant.
    """

    backend: str

    def retune(self, numbers: FilterNumbers) -> None:
        """Take other numbers from now on."""
        ...

    def start(self, x: Array, variances: Array) -> Array:
        """The belief in a state (n,) with independent errors of these variances (n,)."""
        ...

    def covariance(self, belief: Array) -> Array:
        """Covariance (n, n) of a belief."""
        ...

    def advance(self, belief: Array, applied: Array, parameters: Array, measured: Array) -> tuple[Array, Array]:
        """Predict by a share of a sample, and correct by what is measured at its end.

        Parameters
        ----------
        belief : ndarray
            Stays as it is.
        applied : ndarray, shape (nu,)
            Input meanwhile.
        parameters : ndarray
            See `AugmentedModel.parameters`.
        measured : ndarray, shape (m,)
            Not finite where nothing came.

        Returns
        -------
        belief, report : ndarray

        Raises
        ------
        numpy.linalg.LinAlgError
            If the model has no finite value there.
        """
        ...

    def linearise(self, x: Array, applied: Array, parameters: Array) -> tuple[Array, Array, Array, Array]:
        """State after a share of a sample (n,), its derivatives (n, n), what is measured there (m,), and theirs (m, n).

        Raises
        ------
        numpy.linalg.LinAlgError
            If the model has no finite value there.
        """
        ...
