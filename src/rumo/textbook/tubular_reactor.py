"""A tubular reactor with axial dispersion."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import casadi as ca

from rumo.checks import whole_number
from rumo.model import Model, Parameter

GAS_CONSTANT = 8.314
"""In J/(mol K)."""
ZERO = 273.15
"""In K, of degC."""


def tubular_reactor(cells: int = 5) -> Model:
    """Exothermic first-order reaction in a cooled tube, with convection and dispersion along it, in finite volumes.

    States c_1 .. c_n [mol/m^3] and t_1 .. t_n [degC] from inlet to outlet; input jacket [degC], the coolant's
    temperature. Reaction by Arrhenius' law, central differences, Danckwerts' condition at the inlet. The defaults have
    these dimensionless numbers: Peclet number 5, activation energy 25, adiabatic temperature rise 0.5, heat transfer
    2.5. With feed and jacket at 340 K, the steady state gives way to an oscillation at a Damkoehler number of 0.165;
    the default is 0.162. Source: Heinemann and Poore (1981), "Multiplicity, stability, and oscillatory dynamics of
    the tubular reactor".

    Parameters
    ----------
    cells : int
        Number n of equal cells, each with a concentration and a temperature.
    """
    cells = whole_number(cells, "cells", 1)
    concentrations, temperatures = ([f"{kind}_{i + 1}" for i in range(cells)] for kind in "ct")

    def dynamics(x: Any, u: Any, p: Any) -> dict[str, Any]:
        width = p.length / cells

        def carried(values: list[Any], feed: Any) -> list[Any]:
            """What convection and dispersion bring to each cell, per second."""
            flux = [p.velocity * feed]
            flux += [p.velocity * 0.5 * (a + b) + p.dispersion * (a - b) / width for a, b in pairwise(values)]
            flux.append(p.velocity * values[-1])
            return [(before - after) / width for before, after in pairwise(flux)]

        c, t = ([getattr(x, name) for name in names] for names in (concentrations, temperatures))
        activation = p.activation_energy / GAS_CONSTANT
        inverse = 1.0 / (p.feed_temperature + ZERO)
        rates = [
            p.rate * ca.exp(activation * (inverse - 1.0 / (T + ZERO))) * amount for amount, T in zip(c, t, strict=True)
        ]
        by_reaction = p.reaction_heat / p.heat_capacity
        derivatives = [term - rate for term, rate in zip(carried(c, p.feed_concentration), rates, strict=True)]
        derivatives += [
            term + by_reaction * rate - p.heat_transfer / p.heat_capacity * (T - u.jacket)
            for term, rate, T in zip(carried(t, p.feed_temperature), rates, t, strict=True)
        ]
        return dict(zip(concentrations + temperatures, derivatives, strict=True))

    return Model(
        states=dict.fromkeys(concentrations, "mol/m^3") | dict.fromkeys(temperatures, "degC"),
        inputs={"jacket": "degC"},
        dynamics=dynamics,
        parameters={
            "length": Parameter("m", 1.0),
            "velocity": Parameter("m/s", 0.01),
            "dispersion": Parameter("m^2/s", 0.002),
            "rate": Parameter("1/s", 0.00162),  # at the feed's temperature
            "activation_energy": Parameter("J/mol", 25.0 * GAS_CONSTANT * 340.0),
            "reaction_heat": Parameter("J/mol", 142.8e3),
            "heat_capacity": Parameter("J/(m^3 K)", 4.2e6),
            "heat_transfer": Parameter("W/(m^3 K)", 105e3),
            "feed_concentration": Parameter("mol/m^3", 5000.0),
            "feed_temperature": Parameter("degC", 340.0 - ZERO),
        },
        name="tubular_reactor",
    )
