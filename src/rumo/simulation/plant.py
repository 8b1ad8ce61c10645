"""The plant: a model integrated to tight tolerances, its input held over each sample."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import casadi as ca
import numpy as np

from rumo.checks import checked, positive_number
from rumo.errors import PlantError
from rumo.interrupts import interruptible
from rumo.model import Model
from rumo.signals import Array, Signals


class Plant:
    """A model advanced by CVODES, or IDAS if it has algebraic variables (BDF; Hindmarsh et al., 2005).

    Threads must not share one: each takes a `copy.copy`, as each `ClosedLoop` does.

    Parameters
    ----------
    model : Model
        The system that is simulated.
    sampling_time : float
        Interval over which the input is held [s].
    tolerance : float
        Relative tolerance, and absolute tolerance in units of `scales`.
    scales : mapping of str to float, optional
        Size below which a state or algebraic variable does not matter, in its unit; 1 where not given.
    """

    def __init__(
        self,
        model: Model,
        sampling_time: float,
        tolerance: float = 1e-8,
        scales: Mapping[str, float] | None = None,
    ) -> None:
        self.model = checked(model, "model", Model)
        self._settings = (model, sampling_time, tolerance, scales)
        self.name, self.divisible = model.name, True
        self.states, self.inputs = model.states, model.inputs
        observed = (model.algebraic, model.outputs)
        self.outputs = Signals({name: group.unit(name) for group in observed for name in group}, "outputs")
        self.parameters, self.default_parameters = model.parameters, model.default_parameters
        self.sampling_time = positive_number(sampling_time, "sampling_time")
        tolerance = positive_number(tolerance, "tolerance")
        sizes = model.variables.finite_vector(scales or {}, "scales", np.ones(len(model.variables)))
        for name, scale in zip(model.variables, sizes, strict=True):
            positive_number(scale, f"scales[{name!r}]")
        self._scales, z_scales = np.split(sizes, [len(model.states)])
        self._guess = model.algebraic_guess / z_scales
        arguments = model.xz * sizes, model.u, model.p
        rates, duration = model.f(*arguments) / self._scales, ca.SX.sym("duration")
        equations = {"x": model.x, "p": ca.vertcat(model.u, model.p), "ode": rates}
        if len(model.algebraic):
            equations |= {"z": model.z, "alg": model.g(*arguments)}
        parts = equations | {"p": ca.vertcat(model.u, model.p, duration), "ode": duration * rates}
        options = {
            "abstol": tolerance,
            "reltol": tolerance,
            "max_num_steps": 100_000,
            "show_eval_warnings": False,
            "disable_internal_warnings": True,
        }
        method = "idas" if len(model.algebraic) else "cvodes"
        self._integrator = partial(ca.integrator, "plant", method, equations, 0.0, sampling_time, options)
        self._part_integrator = partial(ca.integrator, "part", method, parts, 0.0, 1.0, options)
        self._integrate_part: Any = None
        with interruptible():
            self._integrate = self._integrator()
        self.reset()

    def reset(self) -> None:
        """Forget where the algebraic variables were last: the next ones are looked for near the model's guess."""
        self._z = self._guess

    def advance(self, x: Array, u: Array, p: Array, duration: float | None = None) -> Array:
        """State (nx,) one sampling time, or a duration [s], after x (nx,), inputs u (nu,) and parameters p (np_,) held.

        Algebraic variables are looked for near where they were last.

        Raises
        ------
        PlantError
            If the integration fails or ends in a state that is not finite.
        """
        try:
            with interruptible():
                if duration is None:
                    result = self._integrate(x0=x / self._scales, z0=self._z, p=np.r_[u, p])
                else:
                    self._integrate_part = self._integrate_part or self._part_integrator()
                    result = self._integrate_part(x0=x / self._scales, z0=self._z, p=np.r_[u, p, duration])
                end, z = (result[name].full().ravel() for name in ("xf", "zf"))
        except RuntimeError as error:
            raise PlantError(f"SUNDIALS could not integrate {self.name} from x = {x.tolist()}: {error}") from None
        end = end * self._scales
        if not np.isfinite(end).all():
            raise PlantError(f"{self.name} left the finite numbers from x = {x.tolist()}, u = {u.tolist()}")
        self._z = z
        return end

    def observer(self, names: tuple[str, ...]) -> Callable[[Array, Array, Array], Array]:
        """Function `(x, u, p) -> (n,)` of states and outputs, algebraic variables among them."""
        model = self.model
        given: list[Any] = [model.x, model.u, model.p]
        rows: Any = ca.vertcat(ca.SX(0, 1), *(model.expression(name, "plant") for name in names))
        if len(model.algebraic) and ca.depends_on(rows, model.z):
            of_z = [model.z, *given]
            g = ca.Function("g", of_z, [model.g(model.xz, model.u, model.p)])
            solve, rows = ca.rootfinder("solve", "newton", g), ca.Function("rows", of_z, [rows])
            given = [ca.MX.sym("given", g.size1_in(i)) for i in (1, 2, 3)]
            rows = rows(solve(model.algebraic_guess, *given), *given)
        function = ca.Function("observer", given, [rows])
        return lambda x, u, p: function(x, u, p).full().ravel()

    def __copy__(self) -> Plant:
        """The same, with an integrator and a memory of its own."""
        twin = object.__new__(type(self))
        with interruptible():
            vars(twin).update(vars(self), _integrate=self._integrator(), _integrate_part=None)
        return twin

    def __reduce__(self) -> tuple[type[Plant], tuple[object, ...]]:
        return Plant, self._settings
