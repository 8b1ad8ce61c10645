"""Samples that are skipped, and commands that come late or never: clock and network."""

from __future__ import annotations

from dataclasses import dataclass

from rumo.checks import whole_number
from rumo.simulation.faults.base import Fault, Tellable


@dataclass(frozen=True)
class SkippedSample(Fault):
    """The controller does not run. Actuators hold what was decided last, as far as it knows, which it learns."""

    @property
    def runs(self) -> bool:
        """Never."""
        return False


@dataclass(frozen=True)
class LateCommand(Tellable):
    """The command comes late, from a slow computation or a slow network; actuators hold the last that arrived.

    Parameters
    ----------
    by : int
        Number of samples.
    told : bool
        Controller and estimator know; else they believe that it arrived in time.
    """

    by: int = 1

    def __post_init__(self) -> None:
        super().__post_init__()
        whole_number(self.by, "by", 1)

    @property
    def lateness(self) -> int:
        """Number of samples."""
        return self.by


@dataclass(frozen=True)
class LostCommand(Tellable):
    """The command never arrives; actuators hold the last that did.

    Parameters
    ----------
    told : bool
        Controller and estimator know; else they believe that it arrived.
    """

    @property
    def lateness(self) -> None:
        """Never."""
        return None
