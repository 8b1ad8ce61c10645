"""What references say of what lies ahead, and parameters that this sets in a controller for a while."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from rumo.controllers import Controller
from rumo.errors import ArgumentError
from rumo.references import Preview, Reference
from rumo.signals import Array, NamedArray, Signals


class PreviewedParameters:
    """Parameters of a controller over its own: those that a preview names, from one sample to the next.

    Its own are those before the first preview, and whatever else was set since.
    """

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self._own = self._set = controller.parameters

    def look(self, ahead: Mapping[str, ArrayLike]) -> None:
        """Set the parameters of a preview; those that it does not name are the controller's own."""
        names, now = self._controller.problem.model.parameters, self._controller.parameters
        self._own = np.where(now == self._set, self._own, now)
        stale = zip(names, self._own.T, (now != self._own).any(axis=0), strict=True)
        back: dict[str, ArrayLike] = {name: values for name, values, other in stale if other}
        if back or ahead:
            self._controller.parameters = back | dict(ahead)
        self._set = self._controller.problem.parameters


def previewed(reference: Reference, times: Array, x: NamedArray[float]) -> Preview:
    """What a reference, which may be of the user's making, says of these times [s]."""
    preview = reference.preview(times, x)
    if not isinstance(preview, Preview):
        raise ArgumentError("reference.preview()", repr(preview), "a rumo.references.Preview")
    return preview


def first_of(preview: Preview, outputs: Signals) -> Array:
    """Outputs that are wanted at the first of its times (ny,), NaN where it says nothing of them."""
    return np.array([np.ravel(preview.signals.get(name, np.nan))[0] for name in outputs], dtype=float)
