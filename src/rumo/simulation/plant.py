"""The plant: a model integrated to tight tolerances, its input held over each sample."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from typing import Any, Literal, get_args

import casadi as ca
import numpy as np

from rumo.checks import checked, positive_number
from rumo.errors import ArgumentError, ShapeError
from rumo.kernel import Ending, SystemProgram
from rumo.model import Model
from rumo.signals import Array, Signals
from rumo.simulation.integrators import Integrated, Radau, Sundials
from rumo.simulation.integrators.radau import right_side
from rumo.simulation.observer import fast

logger = logging.getLogger("rumo")

Method = Literal["auto", "radau5", "sundials"]
Backend = Literal["portable", "tailored"]


class Plant:
    """A model advanced by the Radau IIA method of order 5 in the C core, or by SUNDIALS.

    Errors are controlled in proportion to the size of a state, or to its scale where it is smaller: what lies below the
    absolute tolerance and fades may fade at another rate, within that tolerance. Exponential modes that grow are
    followed by the core however small they are, also from 1e-12: its steps are so short that each grows by its true
    factor, to the tolerance in each step, in models of up to 200 states that depend on each other in loops. Where
    growth depends on states it is found as they move, and less exact (see "Closed loop" in the documentation). What
    grows as a power of time, as chains of integrators do, is exact to the tolerance alone, as all is by SUNDIALS. What
    is exactly 0 and has no reason to leave stays 0.

    Threads must not share one: each takes a `copy.copy`, as each `ClosedLoop` does. Where it comes to depends on where
    it began and on what was held since, not on anything before a `reset`.

    Parameters
    ----------
    model : Model
        The system that is simulated.
    sampling_time : float
        Interval over which the input is held [s].
    tolerance : float
        Of the error of a step: relative, and absolute in units of `scales`. The core estimates the error of a formula
        of order 3, which is larger, and lets it be 0.1 tolerance^(2/3), 1e-7 for 1e-9, relative and absolute; that of
        the step itself, of order 5, is then about `tolerance`. SUNDIALS takes it as it is.
    scales : mapping of str to float, optional
        Size below which a state or algebraic variable does not matter, in its unit; 1 where not given.
    method : str
        "radau5": the core (Hairer and Wanner, 1996, IV.8). "sundials": CVODES, or IDAS with algebraic variables
        (Hindmarsh et al., 2005). "auto": the core where it has all operations of the model, and SUNDIALS for samples in
        which it fails and for other models.
    backend : str
        Of the core. "portable": it runs the model's operations. "tailored": they are compiled on first use, which takes
        a second, kept in the same cache as the controllers' builds, and a sample takes less than half of the time.

    Attributes
    ----------
    backend : str
        "tailored", "portable" or "sundials": what it is integrated by.

    Raises
    ------
    ArgumentError
        If the core is to integrate a model that it cannot.
    """

    def __init__(
        self,
        model: Model,
        sampling_time: float,
        tolerance: float = 1e-9,
        scales: Mapping[str, float] | None = None,
        method: Method = "auto",
        backend: Backend = "portable",
    ) -> None:
        self.model = checked(model, "model", Model)
        self._settings = (model, sampling_time, tolerance, scales, method, backend)
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
        self._shapes = (len(model.states),), (len(model.inputs),), (len(model.parameters),)
        self._given = Integrated(model, self.sampling_time, tolerance, sizes)
        self._alone = method != "auto"
        if backend not in get_args(Backend):
            raise ArgumentError("backend", repr(backend), f"one of {', '.join(map(repr, get_args(Backend)))}")
        program = _by_core(model, method)
        self._core = Radau(self._given, program, backend == "tailored") if program else None
        self.backend = self._core.build if self._core else "sundials"
        self._sundials = None if self._core else Sundials(self._given)

    def reset(self) -> None:
        """Forget all that was integrated; algebraic variables are looked for near the model's guess."""
        for integration in (self._core, self._sundials):
            if integration is not None:
                integration.reset()

    def advance(self, x: Array, u: Array, p: Array, duration: float | None = None) -> Array:
        """State (nx,) one sampling time, or a duration [s], after x (nx,), inputs u (nu,) and parameters p (np_,) held.

        Algebraic variables are looked for near where they were last.

        Raises
        ------
        ArgumentError
            If the duration is not a positive finite number.
        PlantError
            If the integration fails or ends in a state that is not finite.
        """
        x, u, p = (np.ascontiguousarray(values, dtype=float) for values in (x, u, p))
        if (x.shape, u.shape, p.shape) != self._shapes:
            raise ShapeError("x, u, p", f"{x.shape}, {u.shape}, {p.shape}", "{}, {}, {}".format(*self._shapes))
        duration = self.sampling_time if duration is None else positive_number(duration, "duration")
        if self._core is None:
            return self._by_sundials().advance(x, u, p, duration)
        if self._alone:
            return self._core.advance(x, u, p, duration)
        end = self._core.try_to_advance(x, u, p, duration)
        return self._once_more(end, x, u, p, duration) if isinstance(end, Ending) else end

    def _once_more(self, ending: Ending, x: Array, u: Array, p: Array, duration: float) -> Array:
        """A sample in which the core failed, by SUNDIALS, from where algebraic variables were."""
        assert self._core is not None
        sundials = self._by_sundials()
        sundials.seek(self._core.algebraic)
        end = sundials.advance(x, u, p, duration)
        logger.debug("SUNDIALS integrates %s from x = %s: %s", self.name, x.tolist(), ending.sentence)
        self._core.seek(sundials.algebraic)
        return end

    def _by_sundials(self) -> Sundials:
        if self._sundials is None:
            self._sundials = Sundials(self._given)
        return self._sundials

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
        return fast(ca.Function("observer", given, [ca.densify(rows)]))

    def __copy__(self) -> Plant:
        """The same, with a memory of its own."""
        twin = object.__new__(type(self))
        vars(twin).update(vars(self))
        twin._core = self._core and self._core.another()
        twin._sundials = None if twin._core else self._by_sundials().another()
        return twin

    def __reduce__(self) -> tuple[type[Plant], tuple[object, ...]]:
        return Plant, self._settings


def _by_core(model: Model, method: Method) -> SystemProgram | None:
    """The right-hand side of a model that the core integrates; raises if it has to and cannot."""
    if method not in get_args(Method):
        raise ArgumentError("method", repr(method), f"one of {', '.join(map(repr, get_args(Method)))}")
    if method == "sundials":
        return None
    found = right_side(model)
    if isinstance(found, SystemProgram):
        return found
    if method == "radau5":
        raise ArgumentError("method", f"'radau5', but {found}", "a model that the core can integrate", 'Or "sundials".')
    return None
