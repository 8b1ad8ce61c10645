"""Any tyre, up to about the peak of its force."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from rumo.checks import positive_number
from rumo.vehicles.parameters import TyreParameters
from rumo.vehicles.tyres.base import Tyre

SHARPNESS = 8
"""Of the bend from slips to the largest slip: within 1 % of the slip up to 0.7 of the largest."""


@dataclass(frozen=True)
class UpToPeak:
    """A tyre whose slips stop growing near the peak of its force, so that the force never falls.

    For predictions: where a force falls with more slip, a linearisation says to steer the other way. What is lost is
    where no controller wants to be.

    Parameters
    ----------
    tyre : Tyre
        Whose forces these are.
    slip : float
        The largest slip, as a multiple of the one at which linear forces reach mu F_z. Most tyres peak at 2 to 4.
    """

    tyre: Tyre
    slip: float = 3.0

    def __post_init__(self) -> None:
        positive_number(self.slip, "UpToPeak.slip")

    def force(
        self, tyre: TyreParameters, sigma: Any, tan_alpha: Any, F_z: Any, mu: Any, direction: Any = 1.0
    ) -> tuple[Any, Any]:
        """Forces (F_x, F_y) [N], see `Tyre`."""
        largest = self.slip * mu * F_z
        return self.tyre.force(
            tyre, _held(sigma, largest / tyre.C_s), _held(tan_alpha, largest / tyre.C_a), F_z, mu, direction
        )


def _held(slip: Any, largest: Any) -> Any:
    return slip / (1.0 + (slip / largest) ** SHARPNESS) ** (1.0 / SHARPNESS)
