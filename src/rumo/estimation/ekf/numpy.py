"""A step of the filter as textbooks have it, in square-root form: the oracle of the core's."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from rumo.estimation.ekf.augmented import AugmentedModel
from rumo.estimation.ekf.engine import FilterNumbers
from rumo.interrupts import interruptible
from rumo.signals import Array


class NumpyFilter:
    """See `FilterEngine`; the factor is S with P = S S', lower triangular.

    Orthogonal transformations of S keep P positive semidefinite whatever is rounded, and S has half of its digits.
    Source: Kailath, Sayed, Hassibi (2000), ch. 12.
    """

    backend = "reference"

    def __init__(self, model: AugmentedModel, numbers: FilterNumbers) -> None:
        self._transcription, self._measurements = model.transcription, model.measurements()
        self._numbers, self._n = numbers, model.size
        self._variables = len(model.transcription.problem.model.variables)

    def retune(self, numbers: FilterNumbers) -> None:
        """See `FilterEngine.retune`."""
        self._numbers = numbers

    def start(self, x: Array, variances: Array) -> Array:
        """See `FilterEngine.start`."""
        return np.concatenate([x, np.diag(np.sqrt(variances)).ravel(), np.zeros(len(self._numbers.noise))])

    def covariance(self, belief: Array) -> Array:
        """See `FilterEngine.covariance`."""
        _, factor, _ = self._parts(belief)
        return factor @ factor.T

    def advance(self, belief: Array, applied: Array, parameters: Array, measured: Array) -> tuple[Array, Array]:
        """See `FilterEngine.advance`."""
        with interruptible(), np.errstate(all="ignore"):  # what is not finite is found at the end
            return self._advance(belief, applied, parameters, measured)

    def _advance(self, belief: Array, applied: Array, parameters: Array, measured: Array) -> tuple[Array, Array]:
        numbers = self._numbers
        x, factor, refused = self._parts(belief.copy())
        x, A, y, H = self._linearised(x, applied, parameters)
        factor, innovation = self._predicted(A @ factor, share=parameters[-1]), measured - y
        turns = np.where(numbers.turn > 0.0, np.floor(innovation / numbers.turn + 0.5), 0.0)
        innovation = np.where(np.isfinite(innovation), innovation - turns * numbers.turn, np.nan)

        factor, deviations, used = self._gated(factor, H, innovation, refused)
        root, gain, factor = self._corrected(factor, H[used], numbers.noise[used])
        normalised = solve_triangular(root, innovation[used], lower=True, check_finite=False)
        sums = [normalised @ normalised, 2.0 * np.log(np.abs(np.diag(root))).sum()]
        belief = np.concatenate([x + gain @ normalised, factor.ravel(), refused])
        if not np.isfinite(belief).all():
            raise np.linalg.LinAlgError("the filter left the finite numbers")
        return belief, np.concatenate([innovation, deviations, 1.0 * used, sums])

    def linearise(self, x: Array, applied: Array, parameters: Array) -> tuple[Array, Array, Array, Array]:
        """See `FilterEngine.linearise`."""
        with interruptible():
            return self._linearised(x, applied, parameters)

    def _linearised(self, x: Array, applied: Array, parameters: Array) -> tuple[Array, Array, Array, Array]:
        w, sensitivity = self._transcription.advance(x, applied, parameters)
        y, H = (value.full() for value in self._measurements(w[: self._variables], applied, parameters))
        return w[: self._n], sensitivity[: self._n], y.ravel(), H

    def _parts(self, belief: Array) -> tuple[Array, Array, Array]:
        n = self._n
        return belief[:n], belief[n : n + n * n].reshape(n, n), belief[n + n * n :]

    def _predicted(self, AS: Array, share: float) -> Array:
        """Factor of A P A' + Q, with no variance below its floor."""
        process = share * self._numbers.process
        lacking = self._numbers.floor - (AS**2).sum(axis=1)
        return triangular(np.hstack([AS, np.diag(np.sqrt(np.maximum(process, lacking)))]))

    def _gated(
        self, factor: Array, H: Array, innovation: Array, refused: Array
    ) -> tuple[Array, Array, NDArray[np.bool_]]:
        """The factor, deviations of the innovations, and which are used; counts those that are refused.

        What was refused too often shows that the filter is wrong: its covariance grows along what the measurement sees,
        until that is no outlier any more.
        """
        numbers = self._numbers
        variances, used = np.full(len(innovation), np.nan), np.isfinite(innovation)
        for j in np.flatnonzero(used):
            seen = ((H[j] @ factor) ** 2).sum()
            variances[j] = seen + numbers.noise[j]
            wanted = (innovation[j] / numbers.width) ** 2
            if wanted > variances[j]:
                refused[j] += 1.0
                if refused[j] <= numbers.patience or seen == 0.0:
                    used[j] = False
                    continue
                along = factor @ (factor.T @ H[j])
                factor = triangular(np.column_stack([factor, along * np.sqrt(wanted - variances[j]) / seen]))
                variances[j] = wanted
            refused[j] = 0.0
        return factor, np.sqrt(variances), used

    @staticmethod
    def _corrected(factor: Array, H: Array, noise: Array) -> tuple[Array, Array, Array]:
        """Factor of the innovations' covariance, the gain for innovations divided by it, and the factor of P after."""
        m = len(H)
        array = np.block([[np.diag(np.sqrt(noise)), H @ factor], [np.zeros((len(factor), m)), factor]])
        lower = triangular(array)
        return lower[:m, :m], lower[m:, :m], lower[m:, m:]


def triangular(array: Array) -> Array:
    """The lower triangular L, square, with L L' = array array'."""
    return np.linalg.qr(array.T).R.T
