"""The real-time iteration of acados on Rumo's problems, to compare with; acados is installed apart."""

from importlib.util import find_spec

from rumo.bench.acados.driver import Replay
from rumo.bench.acados.solver import AcadosRti

__all__ = ["AcadosRti", "Replay", "available"]


def available() -> bool:
    """Whether acados' Python package can be imported."""
    return find_spec("acados_template") is not None
