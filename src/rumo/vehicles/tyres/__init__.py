"""Tyre models: slips and load in, forces in the wheel plane out. One model a file, one protocol for all."""

from rumo.vehicles.tyres.base import EPS_SPEED, Tyre, slip
from rumo.vehicles.tyres.dugoff import Dugoff
from rumo.vehicles.tyres.linear import LinearTyre
from rumo.vehicles.tyres.magic_formula import MagicFormula
from rumo.vehicles.tyres.modified_dugoff import ModifiedDugoff
from rumo.vehicles.tyres.saturating import SaturatingTyre
from rumo.vehicles.tyres.up_to_peak import UpToPeak

__all__ = [
    "EPS_SPEED",
    "Dugoff",
    "LinearTyre",
    "MagicFormula",
    "ModifiedDugoff",
    "SaturatingTyre",
    "Tyre",
    "UpToPeak",
    "slip",
]
