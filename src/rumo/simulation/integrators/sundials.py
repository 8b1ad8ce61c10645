"""CVODES, and IDAS for models with algebraic variables."""

from __future__ import annotations

from functools import partial
from typing import Any

import casadi as ca
import numpy as np

from rumo.errors import PlantError
from rumo.interrupts import interruptible
from rumo.signals import Array
from rumo.simulation.integrators.base import Integrated


class Sundials:
    """Backward differentiation formulas of orders 1 to 5, which begin anew at each call (Hindmarsh et al., 2005).

    Parameters
    ----------
    given : Integrated
        What is integrated.
    """

    def __init__(self, given: Integrated) -> None:
        self._given = given
        model = given.model
        self._scales, self._z_scales = np.split(given.scales, [len(model.states)])
        arguments = model.xz * given.scales, model.u, model.p
        rates, duration = model.f(*arguments) / self._scales, ca.SX.sym("duration")
        equations = {"x": model.x, "p": ca.vertcat(model.u, model.p), "ode": rates}
        if len(model.algebraic):
            equations |= {"z": model.z, "alg": model.g(*arguments)}
        parts = equations | {"p": ca.vertcat(model.u, model.p, duration), "ode": duration * rates}
        options = {
            "abstol": given.tolerance,
            "reltol": given.tolerance,
            "max_num_steps": 100_000,
            "show_eval_warnings": False,
            "disable_internal_warnings": True,
        }
        method = "idas" if len(model.algebraic) else "cvodes"
        self._whole = partial(ca.integrator, "plant", method, equations, 0.0, given.sampling_time, options)
        self._part = partial(ca.integrator, "part", method, parts, 0.0, 1.0, options)
        self._integrate_part: Any = None
        with interruptible():
            self._integrate = self._whole()
        self.reset()

    def reset(self) -> None:
        """See `Integration.reset`."""
        self._z = self._given.model.algebraic_guess / self._z_scales

    def advance(self, x: Array, u: Array, p: Array, duration: float) -> Array:
        """See `Integration.advance`."""
        name = self._given.model.name
        try:
            with interruptible():
                if duration == self._given.sampling_time:
                    result = self._integrate(x0=x / self._scales, z0=self._z, p=np.r_[u, p])
                else:
                    self._integrate_part = self._integrate_part or self._part()
                    result = self._integrate_part(x0=x / self._scales, z0=self._z, p=np.r_[u, p, duration])
                end, z = (result[name].full().ravel() for name in ("xf", "zf"))
        except RuntimeError as error:
            raise PlantError(f"SUNDIALS could not integrate {name} from x = {x.tolist()}: {error}") from None
        end = end * self._scales
        if not np.isfinite(end).all():
            raise PlantError(f"{name} left the finite numbers from x = {x.tolist()}, u = {u.tolist()}")
        self._z = z
        return end

    @property
    def algebraic(self) -> Array:
        """See `Integration.algebraic`."""
        return self._z * self._z_scales

    def seek(self, z: Array) -> None:
        """See `Integration.seek`."""
        self._z = z / self._z_scales

    def another(self) -> Sundials:
        """See `Integration.another`."""
        twin = object.__new__(type(self))
        with interruptible():
            vars(twin).update(vars(self), _integrate=self._whole(), _integrate_part=None)
        twin.reset()
        return twin
