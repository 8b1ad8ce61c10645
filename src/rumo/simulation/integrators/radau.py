"""The Radau IIA method of order 5 in the C core."""

from __future__ import annotations

from typing import Any
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np

from rumo.errors import PlantError
from rumo.kernel import Ending, Integrator, SystemProgram, can_integrate, describe_system, portable, tailored_right_side
from rumo.model import Model
from rumo.recording import missing_in_model, system_program
from rumo.signals import Array
from rumo.simulation.integrators.base import Integrated

_found: WeakKeyDictionary[Model, SystemProgram | str] = WeakKeyDictionary()
"""Right-hand sides, for as long as there are their models: to find one takes longer than many a drive."""


def right_side(model: Model) -> SystemProgram | str:
    """The right-hand side of a model for the core; or why the core cannot integrate it."""
    found = _found.get(model)
    if found is None:
        operation = missing_in_model(model)
        program = None if operation else system_program(model)
        found = f"the core lacks {operation}" if program is None else can_integrate(program) or program
        _found[model] = found
    return found


SLOWLY, MANY_RADIANS = 1e-8, 1e3
"""Growth of a mode, over its size, from which on the core follows it; what takes too many steps [rad]."""


def _jacobian(model: Model, y: Array, u: Array, p: Array) -> Array:
    """Of the states' rates, (nx, nx), where the algebraic variables follow them."""
    given = [model.xz, model.u, model.p]
    rows = ca.vertcat(model.f(*given), model.g(*given)) if len(model.algebraic) else model.f(*given)
    J = ca.Function("J", given, [ca.densify(ca.jacobian(rows, model.xz))])(y, u, p).full()
    n = len(model.states)
    return J[:n, :n] - J[:n, n:] @ np.linalg.lstsq(J[n:, n:], J[n:, :n])[0] if len(J) > n else J


class Radau:
    """Steps of the Radau IIA method of order 5, with the error that they may have (Hairer and Wanner, 1996, IV.8).

    It goes on where it ended: step, Jacobian and the polynomial of the last step are of use then. From another state it
    begins anew.

    Parameters
    ----------
    given : Integrated
        What is integrated.
    program : SystemProgram
        Its right-hand side, see `right_side`.
    compiled : bool
        Whether its right-hand side is compiled, where that is possible.
    """

    def __init__(self, given: Integrated, program: SystemProgram, compiled: bool = False) -> None:
        self._given = given
        self._build = tailored_right_side(program) if compiled else portable()
        self._description = describe_system(program, given.scales, given.model.algebraic_guess, given.tolerance)
        self._start()

    def _start(self) -> None:
        self._integrator = Integrator(self._description, self._build.table)
        self._count, self._algebraic = len(self._given.model.states), len(self._given.model.algebraic)

    def reset(self) -> None:
        """See `Integration.reset`."""
        self._integrator.reset()

    def try_to_advance(self, x: Array, u: Array, p: Array, duration: float) -> Array | Ending:
        """As `advance`, or how it ended otherwise."""
        end = np.empty(self._count)
        ending = self._integrator.advance(x, u, p, duration, end)
        return Ending(ending) if ending else end

    def advance(self, x: Array, u: Array, p: Array, duration: float) -> Array:
        """See `Integration.advance`."""
        end = self.try_to_advance(x, u, p, duration)
        if isinstance(end, Ending):
            name, at = self._given.model.name, f"from x = {x.tolist()}, u = {u.tolist()}"
            why = self._what_limits(x, u, p, duration) if end is Ending.TOO_MANY else ""
            raise PlantError(f"The core could not integrate {name} {at}: {end.sentence}{why}")
        return end

    def _what_limits(self, x: Array, u: Array, p: Array, duration: float) -> str:
        """The mode that grows and is too fast to be followed for so long, with a cure; nothing if there is none."""
        modes = np.linalg.eigvals(_jacobian(self._given.model, np.concatenate([x, self.algebraic]), u, p))
        growing = modes[modes.real > SLOWLY * np.abs(modes)]
        fastest = growing[np.abs(growing).argmax()] if growing.size else 0.0
        if abs(fastest) * duration < MANY_RADIANS:
            return ""
        return (
            f" A mode that grows at {fastest.real:.3g} 1/s and turns at {abs(fastest.imag):.3g} rad/s is followed by"
            f" steps of a fraction of {1.0 / abs(fastest):.1g} s. Damp it in the model, or use"
            ' method="sundials", with small scales if it matters: that goes by its tolerance alone.'
        )

    @property
    def algebraic(self) -> Array:
        """See `Integration.algebraic`."""
        z = np.empty(self._algebraic)
        self._integrator.algebraic(z)
        return z

    def seek(self, z: Array) -> None:
        """See `Integration.seek`."""
        self._integrator.seek(np.ascontiguousarray(z))

    @property
    def build(self) -> str:
        """Whether it is "tailored" or "portable"."""
        return self._build.name

    @property
    def work(self) -> dict[str, Any]:
        """What it has done so far: steps, rejected ones, evaluations of rates and Jacobians, factors, solutions."""
        return self._integrator.work()

    def another(self) -> Radau:
        """See `Integration.another`."""
        twin = object.__new__(type(self))
        vars(twin).update(vars(self))
        twin._start()
        return twin
