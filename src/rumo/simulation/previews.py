"""Parameters that previews set in a controller for a while."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from rumo.controllers import Controller


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
