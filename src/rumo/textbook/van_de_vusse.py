"""Cooled stirred-tank reactor with the van de Vusse reaction."""

from __future__ import annotations

from typing import Any

import casadi as ca

from rumo.model import Model, Parameter

SECONDS_PER_HOUR = 3600.0


def van_de_vusse_reactor() -> Model:
    """Cyclopentenol made from cyclopentadiene, with side reactions and a cooling jacket.

    States c_a, c_b [mol/l], temperature and jacket [degC]; inputs flow [1/h] (feed over tank volume) and cooling
    [kJ/h] (negative takes heat away). Source: Klatt and Engell (1998); constants as in Chen, Kremling and
    Allgoewer (1995), whose operating point is c_a 2.14, c_b 1.09, 114.2 and 112.9 degC at 14.19 1/h, -1113.5 kJ/h.
    """
    density, heat_capacity, volume = 0.9342, 3.01, 10.0  # kg/l, kJ/(kg K), l
    jacket_mass, jacket_heat_capacity = 5.0, 2.0  # kg, kJ/(kg K)
    wall = 4032.0 * 0.215  # heat transfer times area, kJ/(h K)
    heat_ab, heat_bc, heat_ad = 4.2, -11.0, -41.85  # reaction enthalpies, kJ/mol

    def dynamics(x: Any, u: Any, p: Any) -> dict[str, Any]:
        kelvin = x.temperature + 273.15
        k_1 = 1.287e12 * ca.exp(-9758.3 / kelvin)  # 1/h, a -> b and b -> c
        k_3 = 9.043e9 * ca.exp(-8560.0 / kelvin)  # l/(mol h), 2 a -> d
        heat = k_1 * x.c_a * heat_ab + k_1 * x.c_b * heat_bc + k_3 * x.c_a**2 * heat_ad
        to_jacket = wall * (x.temperature - x.jacket)
        per_hour = {
            "c_a": u.flow * (p.feed_concentration - x.c_a) - k_1 * x.c_a - k_3 * x.c_a**2,
            "c_b": -u.flow * x.c_b + k_1 * x.c_a - k_1 * x.c_b,
            "temperature": u.flow * (p.feed_temperature - x.temperature)
            - heat / (density * heat_capacity)
            - to_jacket / (density * heat_capacity * volume),
            "jacket": (u.cooling + to_jacket) / (jacket_mass * jacket_heat_capacity),
        }
        return {name: rate / SECONDS_PER_HOUR for name, rate in per_hour.items()}

    return Model(
        states={"c_a": "mol/l", "c_b": "mol/l", "temperature": "degC", "jacket": "degC"},
        inputs={"flow": "1/h", "cooling": "kJ/h"},
        dynamics=dynamics,
        parameters={
            "feed_concentration": Parameter("mol/l", 5.1),
            "feed_temperature": Parameter("degC", 104.9),
        },
        name="van_de_vusse_reactor",
    )
