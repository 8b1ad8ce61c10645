"""What a step's result is worth."""

from __future__ import annotations

from enum import Enum


class Status(Enum):
    """Outcome of a controller step; the value is a sentence for people.

    Members are ordered from good to bad. Whatever the status, the plan's command is finite and
    within its bounds.
    """

    OPTIMAL = "Solved; every constraint that the inputs can influence holds."
    SOFT_VIOLATED = "Solved; a soft constraint is violated. The plan's slacks say where and by how much."
    UNTRUSTED = "Solved as linearised, which may not hold where the plan leads; it is used, for want of a better one."
    BUDGET_EXCEEDED = "The iteration or time budget ran out; the best admissible plan is used."
    ILL_CONDITIONED = "Too ill-conditioned to trust a solution; the previous plan, shifted, is used."
    SOLVER_FAILED = "The optimisation failed; the previous plan, shifted, is used."
    BAD_REFERENCE = "The reference is not finite where it has a weight; the previous plan, shifted, is used."
    BAD_MEASUREMENT = "The measurement is not finite or implausible; the previous plan, shifted, is used."
    PLAN_EXHAUSTED = "No plan is left to follow; the problem's safe input is applied."

    def __repr__(self) -> str:
        return f"Status.{self.name}"

    @property
    def solved(self) -> bool:
        """Whether the plan is the solution of this step's optimisation problem."""
        return self in (Status.OPTIMAL, Status.SOFT_VIOLATED)

    @property
    def applicable(self) -> bool:
        """Whether the plan that a solver comes to with this status is applied; else the failure policy acts."""
        return self.solved or self in (Status.UNTRUSTED, Status.BUDGET_EXCEEDED)

    @property
    def reason(self) -> str:
        """The first half of the sentence: what happened, without what was done about it."""
        return self.value.partition(";")[0].removesuffix(".") + "."


STATUSES = tuple(Status)
"""In the order of the C core's numbers."""
