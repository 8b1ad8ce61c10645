"""What references say of what lies ahead, and parameters that this sets in a controller for a while."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from rumo.controllers import Controller
from rumo.errors import ArgumentError
from rumo.problem import Problem
from rumo.references import Preview, Reference, ReferenceLike, as_reference, start_reference
from rumo.references.base import OfTime, is_pointwise
from rumo.signals import Array, NamedArray, Signals

BLOCK = 256
"""Samples for which a pointwise reference is asked at once."""


class Previews:
    """What a reference says in a run, sample by sample.

    Parameters
    ----------
    reference : Reference, callable, or mapping of str to float
        As a scenario has it.
    problem : Problem
        Of the controller.
    times : ndarray, shape (K,)
        Of the samples [s].

    Attributes
    ----------
    reference : Reference
        At work.
    """

    def __init__(self, reference: ReferenceLike, problem: Problem, times: Array) -> None:
        self.reference = start_reference(as_reference(reference), problem)
        self._times, self._stages = times, problem.times
        self._by_clock = self.reference if is_pointwise(self.reference) else None
        self._tables: dict[float, _Table] = {}

    def at(self, k: int, lead: float, x: NamedArray[float]) -> Preview:
        """What lies ahead from sample k on, or from `lead` [s] after it; x is the state of the observed model."""
        if self._by_clock is None:
            return previewed(self.reference, self._times[k] + lead + self._stages, x)
        if lead not in self._tables:
            self._tables[lead] = _Table(self._by_clock, self._times + lead, self._stages)
        return self._tables[lead].at(k)


class _Table:
    """Previews of a pointwise reference, made for a block of samples at a time.

    Horizons overlap: most times of a block are those of several samples, and computed once.
    """

    def __init__(self, reference: OfTime, times: Array, stages: Array) -> None:
        self._reference, self._times, self._stages = reference, times, stages
        self._block = -1
        self._names: tuple[str, ...] = ()
        self._values = np.empty(0)

    def at(self, k: int) -> Preview:
        """That of sample k."""
        block, row = divmod(k, BLOCK)
        if block != self._block:
            self._fill(block)
        return Preview.of_own(dict(zip(self._names, self._values[row], strict=True)), {})

    def _fill(self, block: int) -> None:
        ahead = self._times[block * BLOCK : (block + 1) * BLOCK, None] + self._stages
        different, places = np.unique(ahead, return_inverse=True)
        signals = self._reference(different)
        self._block, self._names = block, tuple(signals)
        values = np.array([signals[name] for name in signals]).reshape(len(signals), len(different))
        self._values = np.ascontiguousarray(values[:, places.reshape(ahead.shape)].swapaxes(0, 1))
        self._values.flags.writeable = False


class PreviewedParameters:
    """Parameters of a controller over its own: those that a preview names, from one sample to the next.

    Its own are those before the first preview, and whatever else was set since.
    """

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self._own = self._set = controller.parameters
        self._previewed = False

    def look(self, ahead: Mapping[str, ArrayLike]) -> None:
        """Set the parameters of a preview; those that it does not name are the controller's own."""
        names, now = self._controller.problem.model.parameters, self._controller.parameters
        if not ahead and not self._previewed and now is self._set:
            return
        self._own = np.where(now == self._set, self._own, now)
        stale = zip(names, self._own.T, (now != self._own).any(axis=0), strict=True)
        back: dict[str, ArrayLike] = {name: values for name, values, other in stale if other}
        if back or ahead:
            self._controller.update(parameters=back | dict(ahead))
        self._set = self._controller.problem.parameters
        self._previewed = bool(ahead)


def previewed(reference: Reference, times: Array, x: NamedArray[float]) -> Preview:
    """What a reference, which may be of the user's making, says of these times [s]."""
    preview = reference.preview(times, x)
    if not isinstance(preview, Preview):
        raise ArgumentError("reference.preview()", repr(preview), "a rumo.references.Preview")
    return preview


def first_of(preview: Preview, outputs: Signals) -> Array:
    """Outputs that are wanted at the first of its times (ny,), NaN where it says nothing of them."""
    signals, first = preview.signals, np.full(len(outputs), np.nan)
    for i, name in enumerate(outputs):
        if name in signals:
            first[i] = np.asarray(signals[name]).item(0)
    return first
