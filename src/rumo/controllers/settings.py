"""Settings of controllers: frozen, checked, and changed as a whole."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from rumo.checks import checked, non_negative_number, positive_number, whole_number
from rumo.errors import ArgumentError, UnknownNameError
from rumo.plan import INTEGRATOR_TOLERANCE


@dataclass(frozen=True)
class InnovationGate:
    """Holds back readings that cannot be: far from the prediction, not finite, out of range, or frozen.

    It learns what is usual: at first a reading may be off by `width` times what all inputs together can move its state
    over the next 15 stages, plus what the plan does; 20 samples later by a hundredth of that. What else passes is 2.4
    `width` times the running median of its innovations (eight standard deviations once 40 samples are known); until
    then four times the largest of all; and always 2 `width` times the noise that `Problem(measurements=...)` states. If
    nothing is stated, 0.1 passes until then, in the state's own unit: state the noise of a state that is usually less.

    A reading that is held back is predicted, and the rest of the sample is used, after 40 samples within half these
    limits. Where half of them are, or where a sample repeats the one before in every state although the plan moves on
    by more than sensors resolve, none is: `Status.BAD_MEASUREMENT`. The gate cannot lock itself out: more than
    `patience` readings in a row that agree with each other are believed, and without a plan there is no gate.

    Parameters
    ----------
    width : float
        Half-width of the gate.
    patience : int
        Number of consecutive implausible readings that are held back.
    """

    width: float = 5.0
    patience: int = 8

    def __post_init__(self) -> None:
        positive_number(self.width, "InnovationGate.width")
        whole_number(self.patience, "InnovationGate.patience", 0)


WIDE_GATE = InnovationGate()
SOLVERS = ("auto", "riccati", "condensing")
COARSEST = 1e-3
"""Tolerance of constraints; beyond, hard limits would give way."""

MOST_ITERATIONS, ITERATIONS_EACH = 1000, 10
"""Of a QP's working set, and so many more for each row."""


@dataclass(frozen=True)
class QpOptions:
    """Limits and accuracy of the QP solver.

    Parameters
    ----------
    max_iterations : int, optional
        Changes of the working set in the C core, interior-point iterations of the reference, which takes 200 at most
        and does not count Newton's steps after them; needing more is `Status.BUDGET_EXCEEDED`. If not given, 1000 and
        10 for each row: bounds and moves of each free input, and constraints at each stage.
    tolerance : float
        Accuracy of constraints (C core), or of the interior point that Newton's method starts from (reference), in
        units of the ranges; at most 0.001.
    time_limit : float
        For a step [s], from the call of `step` on, or of `feedback` where `prepare` was called before, which takes as
        long as it takes. Reaching it is `Status.BUDGET_EXCEEDED`, with what there is by then, or the plan before. The C
        core looks at the clock at each stage and iteration, controllers in Python before each QP. A finite limit makes
        results depend on the machine.
    solver : str
        How the C core goes about the horizon: "riccati" keeps the states and takes time linear in the number of
        intervals; "condensing" eliminates them; "auto" condenses where a horizon has no more free inputs than the
        model has states, or up to eight times as many if the model is wide: its equations are solved as they are then.
        Chosen when a controller is made; later on, "auto" is what was chosen then. In the core only.
    """

    max_iterations: int | None = None
    tolerance: float = 1e-10
    time_limit: float = np.inf
    solver: Literal["auto", "riccati", "condensing"] = "auto"

    def __post_init__(self) -> None:
        if self.solver not in SOLVERS:
            raise ArgumentError("QpOptions.solver", repr(self.solver), " or ".join(map(repr, SOLVERS)))
        if self.max_iterations is not None:
            whole_number(self.max_iterations, "QpOptions.max_iterations", 0)
        if positive_number(self.tolerance, "QpOptions.tolerance") > COARSEST:
            raise ArgumentError(
                "QpOptions.tolerance", repr(self.tolerance), f"at most {COARSEST}, a share of the ranges"
            )
        if self.time_limit != np.inf:
            positive_number(self.time_limit, "QpOptions.time_limit")

    def iterations(self, rows: int) -> int:
        """`max_iterations` of a program with so many rows."""
        return MOST_ITERATIONS + ITERATIONS_EACH * rows if self.max_iterations is None else self.max_iterations


@dataclass(frozen=True, kw_only=True)
class ControllerSettings:
    """What every controller has.

    Parameters
    ----------
    gate : InnovationGate, optional
        Holds back implausible measurements; None lets all finite ones pass.
    """

    gate: InnovationGate | None = WIDE_GATE

    def __post_init__(self) -> None:
        if self.gate is not None:
            checked(self.gate, "gate", InnovationGate, "Write InnovationGate(width=...).")


@dataclass(frozen=True, kw_only=True)
class LtvSettings(ControllerSettings):
    """Settings of `LinearTimeVarying`.

    Parameters
    ----------
    qp : QpOptions
        Limits and accuracy of the QP solver.
    """

    qp: QpOptions = QpOptions()

    def __post_init__(self) -> None:
        super().__post_init__()
        checked(self.qp, "qp", QpOptions, "Write QpOptions(max_iterations=...).")


@dataclass(frozen=True, kw_only=True)
class Settings(LtvSettings):
    """Settings of `RealTimeIteration`.

    Parameters
    ----------
    sqp_iterations : int
        Linearisations and QPs per step, until nothing changes; 1 is the real-time iteration, more is sequential
        quadratic programming.
    settling_iterations : int
        Further ones where the first is not to be trusted: with full steps while each is less than half the one before,
        else with steps cut so that each makes the nonlinear problem's cost, with exact penalties, less. They end when
        less than 1 % of the inputs' ranges is left, as an estimate says, and the rest of the time is saved. 0: what is
        not trusted is `Status.UNTRUSTED`, and applied.
    trusted_step : float
        A first iteration is trusted that changes no input by more than this share of its range, about a guess that
        satisfies the dynamics, at a state that is no surprise: near the prediction, as usual. Infinite: the plain
        real-time iteration, in which none is judged.
    preparation_iterations : int
        Iterations in each preparation, on the state predicted for the next sample and with the reference of the last:
        the advanced-step real-time iteration (Nurkanovic et al., 2019). Feedback takes no longer for them.
    tolerance : float
        With more than one of the `sqp_iterations`, stop when no input changes by more than this share of its range, and
        no state by more than this share of how far the inputs can move it.
    integrator_tolerance : float
        Up to which integrator residual `plan.diagnostics` says that the dynamics are integrated.
    """

    sqp_iterations: int = 1
    settling_iterations: int = 100
    trusted_step: float = 0.05
    preparation_iterations: int = 0
    tolerance: float = 1e-9
    integrator_tolerance: float = INTEGRATOR_TOLERANCE

    def __post_init__(self) -> None:
        super().__post_init__()
        whole_number(self.sqp_iterations, "sqp_iterations", 1)
        whole_number(self.settling_iterations, "settling_iterations", 0)
        if self.trusted_step != np.inf:
            non_negative_number(self.trusted_step, "trusted_step")
        whole_number(self.preparation_iterations, "preparation_iterations", 0)
        non_negative_number(self.tolerance, "tolerance")
        non_negative_number(self.integrator_tolerance, "integrator_tolerance")


@dataclass(frozen=True, kw_only=True)
class NlpSettings(ControllerSettings):
    """Settings of `DirectNlp`: limits and accuracy of IPOPT.

    Parameters
    ----------
    tolerance : float
        IPOPT's `tol`.
    max_iterations : int
        Reaching them is `Status.BUDGET_EXCEEDED`.
    max_wall_time : float
        Time limit per step [s]; reaching it is `Status.BUDGET_EXCEEDED`. A finite limit makes results
        depend on the machine.
    """

    tolerance: float = 1e-8
    max_iterations: int = 200
    max_wall_time: float = np.inf

    def __post_init__(self) -> None:
        super().__post_init__()
        positive_number(self.tolerance, "NlpSettings.tolerance")
        whole_number(self.max_iterations, "NlpSettings.max_iterations", 0)
        if self.max_wall_time != np.inf:
            positive_number(self.max_wall_time, "NlpSettings.max_wall_time")


if TYPE_CHECKING:  # `class Mine(rumo.Controller)` needs no argument; Python itself knows defaults from 3.13 on
    from typing_extensions import TypeVar

    S = TypeVar("S", bound=ControllerSettings, default=Any)
else:
    from typing import TypeVar

    S = TypeVar("S", bound=ControllerSettings)


def changed(settings: S, changes: dict[str, Any], kind: type[S]) -> S:
    """Settings of a kind, with other values of those named; another kind or an unknown name raises."""
    if type(settings) is not kind:
        cure = f"Write rumo.{kind.__name__}(**settings)." if isinstance(settings, Mapping) else ""
        raise ArgumentError("settings", repr(settings), f"rumo.{kind.__name__}(...)", cure)
    names = [field.name for field in fields(settings)]
    for name in changes:
        if name not in names:
            raise UnknownNameError("settings", name, names)
    return replace(settings, **changes) if changes else settings
