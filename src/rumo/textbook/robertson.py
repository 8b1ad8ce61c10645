"""Robertson's stiff reaction in a stirred tank."""

from __future__ import annotations

from typing import Any

from rumo.model import Algebraic, Model, Parameter

RATES = {
    "k_slow": Parameter("1/s", 0.04),
    "k_fast": Parameter("1/s", 3e7),
    "k_back": Parameter("1/s", 1e4),
}


def robertson_reactor() -> Model:
    """Robertson's autocatalytic reaction, fed and emptied at a dilution rate; without it, his closed system.

    States a, b, c [1] (concentrations over that of the feed); input dilution [1/s]. The fast intermediate b stays
    near 1e-5 and reacts thousands of times faster than a is used up. Source: Robertson (1966); Hairer and
    Wanner (1996), ch. IV.1.
    """
    return Model(
        states={"a": "1", "b": "1", "c": "1"},
        inputs={"dilution": "1/s"},
        dynamics=_reactions,
        parameters=RATES,
        name="robertson_reactor",
    )


def robertson_dae() -> Model:
    """The same with c as an algebraic variable: the feed has concentration 1, so that a + b + c stays 1.

    States a, b [1], algebraic variable c [1]; input dilution [1/s]. Source: Hindmarsh et al. (2005), whose example of
    a differential-algebraic system it is.
    """

    def dynamics(x: Any, u: Any, p: Any) -> dict[str, Any]:
        rates = _reactions(x, u, p)
        return {"a": rates["a"], "b": rates["b"]}

    return Model(
        states={"a": "1", "b": "1"},
        inputs={"dilution": "1/s"},
        dynamics=dynamics,
        parameters=RATES,
        algebraic={"c": Algebraic("1", lambda x, u, p: 1.0 - x.a - x.b - x.c)},
        name="robertson_dae",
    )


def _reactions(x: Any, u: Any, p: Any) -> dict[str, Any]:
    slow, fast, back = p.k_slow * x.a, p.k_fast * x.b**2, p.k_back * x.b * x.c
    return {
        "a": -slow + back + u.dilution * (1.0 - x.a),
        "b": slow - back - fast - u.dilution * x.b,
        "c": fast - u.dilution * x.c,
    }
