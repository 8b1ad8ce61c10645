"""What a tyre can be asked for along the car, before its wheel locks or spins."""

from __future__ import annotations

from functools import lru_cache

import casadi as ca
import numpy as np

from rumo.vehicles.parameters import TyreParameters
from rumo.vehicles.tyres import ModifiedDugoff

MARGIN = 0.04
"""Share of the largest force that is left: beyond its slip, a wheel spins or locks within a sample."""
SLIPS = np.linspace(0.0, 1.0, 1001)[1:]


@lru_cache(maxsize=256)
def traction(tyre: TyreParameters, load: float) -> float:
    """Share of mu F_z that a tyre with a load [N] may push along the car: 1 for ordinary tyres, less for soft ones.

    A wheel that is told a torque holds as long as more slip gives more force. Tyres with a stiffness of twenty loads
    per unit of slip do so up to forces above mu F_z. Softer ones have their peak below, at slips at which little is
    left across the wheel. Of driving, in which the peak is lower than in braking; by modified Dugoff tyres.
    """
    along, _ = ModifiedDugoff().force(tyre, ca.DM(SLIPS), 0.0, load, tyre.mu)
    return min(1.0, (1.0 - MARGIN) * float(np.abs(along.full()).max()) / (tyre.mu * load))
