"""What can be measured, by name: each runner is made for a recording and replays it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from time import perf_counter_ns
from typing import Any, Protocol

import casadi as ca
import numpy as np

from rumo.bench.acados import available as acados_available
from rumo.controllers import DirectNlp, QpOptions, RealTimeIteration
from rumo.discretization import Discretization
from rumo.problem import Problem
from rumo.signals import Array
from rumo.simulation.replay import Recording


@dataclass(frozen=True)
class Outcome:
    """What came of a replay.

    Attributes
    ----------
    times : ndarray, shape (n, 2)
        Of preparation and feedback [us].
    commands : ndarray, shape (n, nu), optional
        In units of the inputs' ranges, if they are another solver's.
    failed : int
        Samples that were not solved.
    remark : str
        What the reader should know, such as the QP solver.
    """

    times: Array
    commands: Array | None = None
    failed: int = 0
    remark: str = ""


Runner = Callable[[Recording], Outcome]
"""Replays a recording, from nothing to its last sample."""


class Stepped(Protocol):
    """What is called from Python, sample by sample."""

    applied: Any

    def reset(self) -> None:
        """Forget everything."""
        ...

    def prepare(self) -> None:
        """All that needs no measurement."""
        ...

    def feedback(self, x: Array, reference: Array, /) -> Any:
        """The rest."""
        ...


def core(
    recording: Recording, backend: str = "auto", scheme: Discretization | None = None, qp: QpOptions | None = None
) -> Runner:
    """The C core by itself: the loop over samples is in C, and so is the clock."""
    controller = RealTimeIteration(recording.problem, scheme, qp=qp or QpOptions(), backend=backend)
    if controller.backend == "reference":
        return python(recording, lambda problem: RealTimeIteration(problem, scheme, backend="reference"))

    def run(told: Recording) -> Outcome:
        controller.reset()
        return Outcome(1e6 * controller.replay(told.x, told.reference, told.applied)[:, 1:])

    return run


def python(recording: Recording, make: Callable[[Problem], Stepped]) -> Runner:
    """What a caller in Python waits for."""
    controller = make(recording.problem)

    def run(told: Recording) -> Outcome:
        times = np.zeros((len(told), 2))
        controller.reset()
        for i in range(len(told)):
            controller.applied = told.applied[i]
            start = perf_counter_ns()
            controller.prepare()
            middle = perf_counter_ns()
            controller.feedback(told.x[i], told.reference[i])
            times[i] = middle - start, perf_counter_ns() - middle
        return Outcome(1e-3 * times)

    return run


def acados(recording: Recording, integrator: str) -> Runner:
    """The solver of acados in a loop in C, with the QP solver that is the fastest on this drive."""
    from rumo.bench.acados.choice import BestAcados  # compiles; most never need it

    best = BestAcados(recording, integrator)

    def run(told: Recording) -> Outcome:
        replay = best.replay(told)
        return Outcome(1e6 * replay.times, replay.commands, int(np.sum(replay.statuses != 0)), best.chosen)

    return run


def casadi(recording: Recording, qp_solver: str, **settings: Any) -> Runner:
    """One SQP iteration of CasADi, called from Python."""
    from rumo.bench.rivals import CasadiSqp  # only when asked for: it compiles

    return python(recording, partial(CasadiSqp, qp_solver=qp_solver, **settings))


def do_mpc(recording: Recording) -> Runner:
    """The nonlinear program by do-mpc, called from Python."""
    from rumo.bench.rivals.do_mpc import DoMpc  # only when asked for: it takes half a second

    return python(recording, DoMpc)


RUNNERS: dict[str, Callable[[Recording], Runner]] = {
    "rti": core,
    "rti-python": lambda recording: python(recording, RealTimeIteration),
    "rti-tailored": lambda recording: core(recording, "tailored"),
    "rti-portable": lambda recording: core(recording, "portable"),
    "rti-condensing": lambda recording: core(recording, qp=QpOptions(solver="condensing")),
    "rti-reference": lambda recording: core(recording, "reference"),
    "nlp": lambda recording: python(recording, DirectNlp),
    "acados": lambda recording: acados(recording, "IRK"),
    "acados-lifted": lambda recording: acados(recording, "LIFTED_IRK"),
    "acados-discrete": lambda recording: acados(recording, "DISCRETE"),
    "casadi-hpipm": lambda recording: casadi(recording, "hpipm"),
    "casadi-osqp": lambda recording: casadi(recording, "osqp"),
    "do-mpc": do_mpc,
    "casadi-osqp-wide": lambda recording: casadi(recording, "osqp", compiled=False, rho=10.0),
}
"""By name: the default backend (`rti`), the same as called from Python, each backend, states condensed, IPOPT; acados
with its own implicit integrators, and with a Newton step that was eliminated by hand; of pip alone, CasADi's SQP
method, do-mpc."""

USUAL = ("rti", "rti-python", "rti-portable", "rti-reference", "nlp", "acados", "acados-discrete")
"""Measured if nobody says which."""
COMPILED = ("rti", "rti-portable", "acados", "acados-discrete")
"""In a sweep: loops in C alone."""


def installed(name: str) -> bool:
    """Whether what a runner needs is here."""
    if name.startswith("casadi-"):
        return ca.has_conic(name.split("-")[1])
    if name == "do-mpc":
        return find_spec("do_mpc") is not None
    return acados_available() if name.startswith("acados") else True
