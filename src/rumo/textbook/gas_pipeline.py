"""Gas in a long pipeline."""

from __future__ import annotations

from typing import Any

import casadi as ca

from rumo.checks import whole_number
from rumo.model import Algebraic, Model, Parameter


def gas_pipeline(sections: int = 6) -> Model:
    """Isothermal flow of gas from a compressor to a consumer: storage in each section, friction between them.

    States p_1 .. p_n [bar], algebraic variables q_1 .. q_n [kg/s], the flow out of each section, from the squares of
    the pressures at both ends; input supply [kg/s]. Inertia is left out, friction becomes laminar at small flows. The
    defaults are 60 km of a 0.6 m pipe. Source: Osiadacz, "Simulation and Analysis of Gas Networks" (1987), ch. 4.

    Parameters
    ----------
    sections : int
        Number n of equal sections, each with a pressure and a flow.
    """
    sections = whole_number(sections, "sections", 1)
    pressures, flows = ([f"{kind}_{i + 1}" for i in range(sections)] for kind in "pq")
    pascal = 1e5  # per bar

    def dynamics(x: Any, u: Any, p: Any) -> dict[str, Any]:
        flow = [u.supply, *(getattr(x, name) for name in flows)]
        storage = ca.pi / 4.0 * p.diameter**2 * p.length / sections / p.sound_speed**2 * pascal  # kg/bar
        return {name: (flow[i] - flow[i + 1]) / storage for i, name in enumerate(pressures)}

    def friction(i: int) -> Any:
        def equation(x: Any, u: Any, p: Any) -> Any:
            before, flow = getattr(x, pressures[i]), getattr(x, flows[i])
            after = getattr(x, pressures[i + 1]) if i + 1 < sections else p.delivery_pressure
            area = ca.pi / 4.0 * p.diameter**2
            drag = p.friction * p.length / sections * (p.sound_speed / area / pascal) ** 2 / p.diameter
            return before**2 - after**2 - drag * flow * ca.sqrt(flow**2 + p.laminar_flow**2)

        return equation

    return Model(
        states=dict.fromkeys(pressures, "bar"),
        inputs={"supply": "kg/s"},
        dynamics=dynamics,
        parameters={
            "length": Parameter("m", 60e3),
            "diameter": Parameter("m", 0.6),
            "friction": Parameter("1", 0.01),  # Darcy's
            "sound_speed": Parameter("m/s", 380.0),
            "laminar_flow": Parameter("kg/s", 1.0),
            "delivery_pressure": Parameter("bar", 50.0),
        },
        algebraic={name: Algebraic("kg/s", friction(i), guess=60.0) for i, name in enumerate(flows)},
        name="gas_pipeline",
    )
