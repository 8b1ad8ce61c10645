"""Other ways to solve Rumo's problems that come from pip alone, called from Python like any controller."""

from rumo.bench.rivals.sqp import CasadiSqp

__all__ = ["CasadiSqp"]
