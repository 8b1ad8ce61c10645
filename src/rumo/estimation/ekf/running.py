"""The filter at work: it starts, takes each measurement for the time when it was made, and starts again."""

from __future__ import annotations

from collections import deque
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from rumo.actuation.timing import in_samples
from rumo.checks import finite_number
from rumo.errors import ArgumentError
from rumo.estimation.base import Estimate
from rumo.estimation.ekf.augmented import AugmentedModel
from rumo.estimation.ekf.engine import FilterEngine, FilterNumbers
from rumo.estimation.innovation import Innovation
from rumo.signals import Array

LOG_TWO_PI = float(np.log(2.0 * np.pi))


@dataclass(frozen=True, eq=False)
class FirstBelief:
    """What a filter starts from.

    Attributes
    ----------
    x : ndarray, shape (n,)
        NaN for states that start at what is measured of them, and for unknown parameters that start at what the filter
        is told.
    variances : ndarray, shape (n,)
        Of their errors.
    places : ndarray of int, shape (n,)
        Which measurement a state starts at, -1 for none.
    told : ndarray of int, shape (n,)
        Which of the parameters told an unknown starts at, -1 for none.
    """

    x: Array
    variances: Array
    places: np.ndarray
    told: np.ndarray


@dataclass(eq=False)
class _Sample:
    """What is known of a sample: inputs until then, parameters, measurements as they come in."""

    before: Array
    applied: Array
    parameters: Array
    measured: Array


@dataclass(frozen=True, eq=False)
class FilterParts:
    """What a filter is made of.

    Attributes
    ----------
    model : AugmentedModel
        What is estimated.
    engine : FilterEngine
        What computes a step, with these
    numbers : FilterNumbers
        Of its own.
    first : FirstBelief
        Where it starts.
    late : ndarray, shape (m,)
        Samples, and fractions of one, from a measurement to its arrival.
    states : tuple of str
        Names of the controller's states, the first of those estimated,
    parameters, biases : tuple of str
        and of the others.
    """

    model: AugmentedModel
    engine: FilterEngine
    numbers: FilterNumbers
    first: FirstBelief
    late: Array
    states: tuple[str, ...]
    parameters: tuple[str, ...]
    biases: tuple[str, ...]

    def estimate(self, x: Array, covariance: Array, innovation: Innovation | None) -> Estimate:
        """Of all that is estimated, x (n,) with covariance (n, n)."""
        nx, p = len(self.states), len(self.states) + len(self.parameters)
        if not self.parameters and not self.biases:
            return Estimate(x.copy(), covariance, innovation=innovation)
        values, deviations = x[nx : len(covariance)].tolist(), np.sqrt(np.diag(covariance)[nx:]).tolist()
        return Estimate(
            x[:nx].copy(),
            covariance[:nx, :nx].copy(),
            dict(zip(self.parameters, values, strict=False)),
            dict(zip(self.biases, values[p - nx :], strict=True)),
            dict(zip((*self.parameters, *self.biases), deviations, strict=True)),
            innovation,
        )


class RunningExtendedKalman:
    """A filter with memory; it starts when each state without a first estimate has been measured once.

    Parameters
    ----------
    parts : FilterParts
        What it is made of.

    Attributes
    ----------
    innovation : Innovation or None
        Of the latest sample all of whose measurements have come, if there was one at the last update.
    backend : str
        "portable" for the C core, "reference" for NumPy.
    input_age : float
        Share of a sample that an input needs until it acts, 0 or more and less than 1; until then the one before does.
    """

    def __init__(self, parts: FilterParts) -> None:
        self._parts, self._numbers, late = parts, parts.numbers, parts.late
        self._model, self._engine, self._first = parts.model, parts.engine, parts.first
        self._states = len(parts.states)
        parted = [in_samples(samples) for samples in late.tolist()]
        self._whole = np.array([whole for whole, _ in parted], dtype=int)
        self._ends, self._input_age = np.array([1.0 - share for _, share in parted]), 0.0
        self._stop()
        self._oldest = int(self._whole.max(initial=0))
        self._prompt = (self._whole == 0) & (self._ends == 1.0)
        self._seen = self._first.x
        self._belief: Array | None = None
        self._applied: Array | None = None
        self._recent: deque[_Sample] = deque()
        self.innovation: Innovation | None = None
        self.backend = self._engine.backend

    @property
    def goes_back(self) -> bool:
        """Whether some measurements are late, so that innovations are not those of the sample that came last."""
        return self._oldest > 0 or bool((self._ends < 1.0).any())

    @property
    def input_age(self) -> float:
        """See the class."""
        return self._input_age

    @input_age.setter
    def input_age(self, share: float) -> None:
        if not 0.0 <= finite_number(share, "input_age") < 1.0:
            raise ArgumentError("input_age", repr(share), "a share of a sample, less than 1", "Whole ones are a delay.")
        self._input_age = share
        self._stop()

    def _stop(self) -> None:
        """When, as a share of the sample, steps end, and which measurements are made there."""
        self._times = [(end, self._ends == end) for end in sorted({*self._ends.tolist(), self._input_age, 1.0} - {0.0})]

    @property
    def belief(self) -> tuple[Array, Array] | None:
        """All that is estimated (n,) and its covariance (n, n), of the latest sample that is complete."""
        if self._belief is None:
            return None
        return self._belief[: self._model.size].copy(), self._engine.covariance(self._belief)

    def forget(self) -> None:
        """Start anew at the next sample."""
        self._belief, self._applied, self.innovation, self._seen = None, None, None, self._first.x
        self._recent.clear()

    def retune(self, process: Array) -> None:
        """Take other standard deviations of what the model misses in one sample (nx,), from the next sample on."""
        variances = self._numbers.process.copy()
        variances[: self._states] = np.square(process)
        self._numbers = replace(self._numbers, process=variances)
        self._engine.retune(self._numbers)

    def update(self, measured: Array, applied: Array, parameters: Array) -> Estimate:
        """Estimate from measurements (m,), see `RunningEstimator`; those that are not finite are left to prediction."""
        measured, self.innovation = np.asarray(measured, dtype=float), None
        before, self._applied = applied if self._applied is None else self._applied, applied.copy()
        if self._belief is None:
            return self._start(measured, applied, parameters)
        try:
            belief = self._advanced(self._belief, _Sample(before, applied, parameters, measured))
        except np.linalg.LinAlgError:
            # The model has no value here: start anew at the next good sample.
            self.forget()
            return Estimate(self._begin(measured, parameters)[: self._states])
        return self._estimate(belief)

    def _advanced(self, belief: Array, now: _Sample) -> Array:
        """The belief now; what is known of samples all of whose measurements have come is kept."""
        if not self._oldest:
            self._belief, self.innovation = self._advance(belief, now)
            return self._belief
        recent = self._recent
        nothing = np.full(len(now.measured), np.nan)
        recent.append(_Sample(now.before, now.applied.copy(), now.parameters.copy(), nothing))
        for j, late in enumerate(self._whole.tolist()):
            if late < len(recent):
                recent[-1 - late].measured[j] = now.measured[j]
        if len(recent) > self._oldest:
            self._belief, self.innovation = self._advance(belief, recent.popleft())
            belief = self._belief
        for sample in recent:
            belief, _ = self._advance(belief, sample)
        return belief

    def _advance(self, belief: Array, sample: _Sample) -> tuple[Array, Innovation]:
        """One sample on, with stops where something was measured on the way."""
        if len(self._times) == 1:
            belief, report = self._step(belief, sample.applied, sample, 1.0, sample.measured)
            return belief, _innovation(report)
        done, m, whole = 0.0, len(sample.measured), np.array([])
        for end, here in self._times:
            measured = np.where(here, sample.measured, np.nan)
            if end < 1.0 and end != self._input_age and not np.isfinite(measured).any():
                continue
            applied = sample.before if end <= self._input_age else sample.applied
            belief, report = self._step(belief, applied, sample, end - done, measured)
            done = end
            if len(whole):  # each measurement is in one report, and sums of squares add up
                report[: 2 * m] = np.where(np.isnan(report[: 2 * m]), whole[: 2 * m], report[: 2 * m])
                report[2 * m :] += whole[2 * m :]
            whole = report
        return belief, _innovation(whole)

    def _step(
        self, belief: Array, applied: Array, sample: _Sample, share: float, measured: Array
    ) -> tuple[Array, Array]:
        parameters = self._model.parameters(sample.parameters, share)
        return self._engine.advance(belief, applied, parameters, measured)

    def _start(self, measured: Array, applied: Array, parameters: Array) -> Estimate:
        now = self._begin(measured, parameters)
        self._seen = np.where(np.isfinite(now), now, self._seen)
        if not np.isfinite(self._seen).all():
            return Estimate(self._seen[: self._states].copy())
        belief = self._engine.start(self._seen, self._first.variances)
        rest = np.where(self._prompt, measured, np.nan)
        rest[self._first.places[self._first.places >= 0]] = np.nan  # those that it starts at
        if np.isfinite(rest).any():
            with suppress(np.linalg.LinAlgError):  # where it starts, the others say nothing
                belief, _ = self._step(belief, applied, _Sample(applied, applied, parameters, rest), 0.0, rest)
        self._belief = belief
        return self._estimate(belief)

    def _begin(self, measured: Array, parameters: Array) -> Array:
        """What is measured and told of states now (n,), first estimates of the others."""
        x, first = self._first.x.copy(), self._first
        measures, tells = first.places >= 0, first.told >= 0
        x[measures], x[tells] = measured[first.places[measures]], parameters[first.told[tells]]
        return x

    def _estimate(self, belief: Array) -> Estimate:
        n = self._model.size
        return self._parts.estimate(belief[:n], self._engine.covariance(belief), self.innovation)


def _innovation(report: Array) -> Innovation:
    m = len(report) // 3
    used, nis, log_determinant = report[2 * m : 3 * m] > 0.0, float(report[-2]), float(report[-1])
    log_likelihood = -0.5 * (nis + log_determinant + LOG_TWO_PI * np.count_nonzero(used))
    return Innovation(report[:m], report[m : 2 * m], used, nis, log_likelihood)
