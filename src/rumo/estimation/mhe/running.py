"""A moving horizon at work: the window slides, is linearised, and solved once each sample."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from rumo.estimation.base import Estimate
from rumo.estimation.ekf.numpy import triangular
from rumo.estimation.ekf.running import LOG_TWO_PI, FilterParts, RunningExtendedKalman
from rumo.estimation.innovation import Innovation
from rumo.estimation.mhe.program import WindowProgram
from rumo.signals import Array
from rumo.status import Status


@dataclass(eq=False)
class _Interval:
    """A sample of the window: the input held until then, parameters, measurements, and a guess of the state there."""

    applied: Array
    parameters: Array
    measured: Array
    x: Array


@dataclass(frozen=True, eq=False)
class _Linear:
    """The window linearised: state k is e[k] + Phi[k] v, its measurements are `less` beyond those of the guess."""

    e: Sequence[Array]
    Phi: Sequence[Array]
    G: Array
    r: Array


class RunningMovingHorizon:
    """An estimator with memory. It starts as an extended Kalman filter does, whose first estimate is the first arrival.

    Attributes
    ----------
    status : Status
        Of the last sample's program: OPTIMAL; BUDGET_EXCEEDED if outliers were not sorted out; SOLVER_FAILED if bounds
        contradict each other, and nothing but squares counts then, or if the model has no finite value, and it starts
        anew.
    counts : Counter of Status
        Samples by status.
    innovation : Innovation or None
        Of what came at the last sample: measured less predicted from the window before.
    """

    def __init__(
        self,
        parts: FilterParts,
        late: np.ndarray,
        window: int,
        limits: tuple[Array, Array],
        noise: tuple[Array, Array],
        huber: float,
    ) -> None:
        self._parts, self._late, self._window, self._limits, self._huber = parts, late, window, limits, huber
        self._beginning = RunningExtendedKalman(parts)
        self._roots, self._sigma = np.sqrt(parts.numbers.process), np.sqrt(parts.numbers.noise)
        with np.errstate(divide="ignore", invalid="ignore"):
            self._noise = tuple(
                np.where(np.isinf(side) | (self._roots == 0.0), side, side / self._roots) for side in noise
            )
        self._recent: deque[_Interval] = deque()
        self._arrival: tuple[Array, Array] | None = None  # state and factor of its covariance before the window
        self._start_x = np.zeros(parts.model.size)
        self._covariance = np.zeros((parts.model.size, parts.model.size))
        self.status = Status.OPTIMAL
        self.counts: Counter[Status] = Counter()
        self.innovation: Innovation | None = None

    def update(self, measured: Array, applied: Array, parameters: Array) -> Estimate:
        """Estimate from measurements (m,), see `RunningEstimator`; those that are not finite are left out."""
        measured, self.innovation = np.asarray(measured, dtype=float), None
        if self._arrival is None:
            return self._begin(measured, applied, parameters)
        try:
            x = self._advanced(measured, applied, parameters)
        except np.linalg.LinAlgError:
            self._finish(Status.SOLVER_FAILED)
            self._arrival = None
            self._recent.clear()
            self._beginning.forget()
            return self._begin(measured, applied, parameters)
        return self._parts.estimate(x, self._covariance, self.innovation)

    def _begin(self, measured: Array, applied: Array, parameters: Array) -> Estimate:
        estimate = self._beginning.update(measured, applied, parameters)
        belief = self._beginning.belief
        if belief is not None:
            self._start_x, self._covariance = belief
            self._arrival = self._start_x, triangular(np.linalg.cholesky(self._covariance))
        return estimate

    def _finish(self, status: Status) -> None:
        self.status = status
        self.counts[status] += 1

    def _advanced(self, measured: Array, applied: Array, parameters: Array) -> Array:
        """One sample more; the state at its end."""
        recent = self._recent
        if len(recent) == self._window:
            self._slide()
        last = recent[-1].x if recent else self._start_x
        nothing = np.full(len(measured), np.nan)
        now = _Interval(applied.copy(), parameters.copy(), nothing, last)
        now.x, A, y, H = self._parts.engine.linearise(last, applied, self._parts.model.parameters(parameters))
        recent.append(now)
        for j, late in enumerate(self._late.tolist()):
            if late < len(recent):
                recent[-1 - late].measured[j] = measured[j]
        self.innovation = self._surprise(now.measured - y, A, H)
        linear = self._linearised()
        program = self._program(linear)
        v, status = program.solve()
        states = [e + Phi @ v for e, Phi in zip(linear.e, linear.Phi, strict=True)]
        if not all(np.isfinite(x).all() for x in states):
            raise np.linalg.LinAlgError("the window left the finite numbers")
        self._finish(status)
        self._start_x = states[0]
        for interval, x in zip(recent, states[1:], strict=True):
            interval.x = x
        weighted = linear.G * np.sqrt(program.weights(v))[:, None]
        information = cho_factor(np.eye(len(v)) + weighted.T @ weighted, check_finite=False)
        self._covariance = linear.Phi[-1] @ cho_solve(information, linear.Phi[-1].T, check_finite=False)
        return states[-1]

    def _surprise(self, innovation: Array, A: Array, H: Array) -> Innovation:
        """What came, as a filter with this window's covariance would see it."""
        innovation = self._wrapped(innovation)
        P = A @ self._covariance @ A.T + np.diag(self._roots**2)
        S = H @ P @ H.T + np.diag(self._sigma**2)
        used = np.isfinite(innovation)
        deviations = np.where(used, np.sqrt(np.diag(S)), np.nan)
        nu, own = innovation[used], S[np.ix_(used, used)]
        nis, log_determinant = float(nu @ np.linalg.solve(own, nu)), float(np.linalg.slogdet(own)[1])
        likelihood = -0.5 * (nis + log_determinant + LOG_TWO_PI * len(nu))
        return Innovation(innovation, deviations, used, nis, likelihood)

    def _wrapped(self, innovation: Array) -> Array:
        turn = self._parts.numbers.turn
        whole = np.where(turn > 0.0, turn, 1.0)
        innovation = np.where(np.isfinite(innovation), innovation, np.nan)
        return innovation - np.where(turn > 0.0, turn * np.floor(innovation / whole + 0.5), 0.0)

    def _measured(self, interval: _Interval) -> tuple[Array, Array]:
        """Innovations at a guess, over their noise (m,), NaN where there are none, and derivatives (m, n)."""
        nowhere = self._parts.model.parameters(interval.parameters, 0.0)
        _, _, y, H = self._parts.engine.linearise(interval.x, interval.applied, nowhere)
        return self._wrapped(interval.measured - y) / self._sigma, H / self._sigma[:, None]

    def _predicted(self, x: Array, interval: _Interval) -> tuple[Array, Array]:
        """State at the end of an interval that begins at x, and its derivatives."""
        told = self._parts.model.parameters(interval.parameters)
        end, A, _, _ = self._parts.engine.linearise(x, interval.applied, told)
        return end, A

    def _linearised(self) -> _Linear:
        """The window in terms of v: the arrival's error, then the noise of each sample, all of unit variance."""
        assert self._arrival is not None
        n, size = self._parts.model.size, self._parts.model.size * (len(self._recent) + 1)
        (mean, factor), guess = self._arrival, self._start_x
        Phi = np.zeros((n, size))
        Phi[:, :n] = factor
        e, es, Phis, Gs, rs = mean, [mean], [Phi], list[Array](), list[Array]()
        for k, interval in enumerate(self._recent, 1):
            end, A = self._predicted(guess, interval)
            e, Phi, guess = end + A @ (e - guess), A @ Phi, interval.x
            Phi[:, k * n : (k + 1) * n] += np.diag(self._roots)
            left, H = self._measured(interval)
            known = np.isfinite(left)
            Gs.append(H[known] @ Phi)
            rs.append((left - H @ (e - guess))[known])
            es.append(e)
            Phis.append(Phi)
        return _Linear(es, Phis, np.vstack(Gs), np.concatenate(rs))

    def _program(self, linear: _Linear) -> WindowProgram:
        lower, upper = self._limits
        bounded = np.flatnonzero(np.isfinite(lower) | np.isfinite(upper))
        n, size = self._parts.model.size, len(linear.Phi[0][0])
        noisy = np.flatnonzero(np.isfinite(self._noise[0]) | np.isfinite(self._noise[1]))
        places = (np.arange(n, size, n)[:, None] + noisy).ravel()
        e, intervals = np.array(linear.e)[:, bounded], len(linear.e) - 1
        return WindowProgram(
            linear.G,
            linear.r,
            np.vstack([*(Phi[bounded] for Phi in linear.Phi), np.eye(size)[places]]),
            np.concatenate([(lower[bounded] - e).ravel(), np.tile(self._noise[0][noisy], intervals)]),
            np.concatenate([(upper[bounded] - e).ravel(), np.tile(self._noise[1][noisy], intervals)]),
            self._huber,
        )

    def _slide(self) -> None:
        """The oldest sample leaves the window: the arrival becomes that of its end, as linearised at what was found."""
        assert self._arrival is not None
        (mean, factor), interval = self._arrival, self._recent.popleft()
        end, A = self._predicted(self._start_x, interval)
        mean = end + A @ (mean - self._start_x)
        factor = triangular(np.hstack([A @ factor, np.diag(self._roots)]))
        left, H = self._measured(interval)
        known = np.isfinite(left)
        size = np.abs(left[known])
        # An outlier counts as little as in the window.
        root = np.sqrt(np.where(size > self._huber, self._huber / np.maximum(size, 1e-300), 1.0))
        seen, left = H[known] * root[:, None], (left - H @ (mean - interval.x))[known] * root
        m, n = len(left), len(mean)
        array = triangular(np.block([[np.eye(m), seen @ factor], [np.zeros((n, m)), factor]]))
        mean = mean + array[m:, :m] @ np.linalg.solve(array[:m, :m], left)
        self._arrival, self._start_x = (mean, array[m:, m:]), interval.x
