"""The drive that is made harder: the case study without noise and wind."""

from __future__ import annotations

from dataclasses import dataclass

from rumo.simulation import Constant
from rumo.studies.paper import CLOSE_WEIGHTS, PaperStudy


@dataclass(frozen=True)
class Drive(PaperStudy):
    """The case study with a car that may point away from its path at first.

    Parameters
    ----------
    heading_error : float
        Angle from the path's tangent to the car at the start [rad].
    """

    heading_error: float = 0.0

    def initial_state(self) -> dict[str, float]:
        """Plant state at the start, driving straight ahead without slip."""
        state = super().initial_state()
        return state | {"psi": state["psi"] + self.heading_error}


BASE = Drive(weights=CLOSE_WEIGHTS, estimator=None, noise={}, wind=Constant(0.0), initial_error=0.0)
"""The drive that is made harder: the paper's path and car, but exact measurements, no wind, a start on the path."""
