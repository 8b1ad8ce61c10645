"""A rod heated at one end."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from rumo.checks import whole_number
from rumo.model import Model, Parameter


def heat_rod(cells: int = 8) -> Model:
    """Heat conduction along a rod in finite volumes: a heat flux enters at one end, the other is held at a temperature.

    States t_1 .. t_n [degC], from the heated end; input heating [W/m^2]. The defaults are 0.3 m of aluminium, whose
    slowest mode takes some 370 s. Source: Carslaw and Jaeger, "Conduction of Heat in Solids" (1959), ch. III; cells
    as in Patankar, "Numerical Heat Transfer and Fluid Flow" (1980), ch. 4.

    Parameters
    ----------
    cells : int
        Number n of equal cells, each with one temperature.
    """
    names = [f"t_{i + 1}" for i in range(whole_number(cells, "cells", 1))]

    def dynamics(x: Any, u: Any, p: Any) -> dict[str, Any]:
        width = p.length / cells
        t = [getattr(x, name) for name in names]
        flux = [u.heating, *(p.conductivity * (a - b) / width for a, b in pairwise(t))]
        flux.append(p.conductivity * (t[-1] - p.end_temperature) / (0.5 * width))
        storage = p.density * p.heat_capacity * width
        return {name: (flux[i] - flux[i + 1]) / storage for i, name in enumerate(names)}

    return Model(
        states=dict.fromkeys(names, "degC"),
        inputs={"heating": "W/m^2"},
        dynamics=dynamics,
        parameters={
            "length": Parameter("m", 0.3),
            "conductivity": Parameter("W/(m K)", 237.0),
            "density": Parameter("kg/m^3", 2700.0),
            "heat_capacity": Parameter("J/(kg K)", 897.0),
            "end_temperature": Parameter("degC", 20.0),
        },
        name="heat_rod",
    )
