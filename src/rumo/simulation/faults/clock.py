"""Samples that are skipped, and commands that come late or never: clock and network."""

from __future__ import annotations

from dataclasses import dataclass

from rumo.checks import whole_number
from rumo.simulation.faults.base import Fault


@dataclass(frozen=True)
class SkippedSample(Fault):
    """The controller does not run. Actuators hold what was decided last, as it learns when it runs again."""

    @property
    def runs(self) -> bool:
        """Never."""
        return False


@dataclass(frozen=True)
class LateCommand(Fault):
    """The command comes late, from a slow computation or a slow network; actuators hold the last that arrived.

    Parameters
    ----------
    by : int
        Number of samples.
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
class LostCommand(Fault):
    """The command never arrives; actuators hold the last that did, and the controller does not know."""

    @property
    def lateness(self) -> None:
        """Never."""
        return None
