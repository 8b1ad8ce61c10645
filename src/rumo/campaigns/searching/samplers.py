"""What proposes settings: samplers of Optuna's whose draws are decided by a text alone."""

from __future__ import annotations

from hashlib import sha256
from typing import Any

from rumo.extras import required

SAMPLERS = ("tpe", "cma-es", "nsga2", "random")
"""By name."""
SEVERAL = ("tpe", "nsga2", "random")
"""Those that can take several objectives."""
CMA_ES = "cma-es"
POPULATION = 24
"""Of NSGA-II: Optuna's 50 are too many for a few hundred trials, which would be a few generations."""


def made_sampler(optuna: Any, name: str, decided_by: str) -> Any:
    """A sampler that has proposed nothing yet; the same text gives the same draws.

    Parameters
    ----------
    optuna : module
        The package.
    name : str
        One of `SAMPLERS`.
    decided_by : str
        What its draws depend on.

    Raises
    ------
    ArgumentError
        If a package is missing that it needs.
    """
    seed, samplers = int.from_bytes(sha256(decided_by.encode()).digest()[:4]), optuna.samplers
    if name == CMA_ES:
        required("cmaes", "campaign", f'sampler "{CMA_ES}"')
        return samplers.CmaEsSampler(seed=seed, warn_independent_sampling=False)
    if name == "nsga2":
        # Optuna's own only mixes values that are there: of numbers it would hardly try others.
        crossover = samplers.nsgaii.SBXCrossover()
        return samplers.NSGAIISampler(seed=seed, population_size=POPULATION, crossover=crossover)
    if name == "random":
        return samplers.RandomSampler(seed=seed)
    return samplers.TPESampler(seed=seed, multivariate=True, warn_independent_sampling=False)
