"""What a judge comes to, and what is told of steps in numbers."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from rumo.status import STATUSES, Status

OPTIMAL, SOFT = (STATUSES.index(s) for s in (Status.OPTIMAL, Status.SOFT_VIOLATED))
BAD_REFERENCE, BAD_MEASUREMENT = (STATUSES.index(s) for s in (Status.BAD_REFERENCE, Status.BAD_MEASUREMENT))


@dataclass
class Verdict:
    """What a judge found: steps that are bad, by number, and why; and of how many it could not tell."""

    bad: dict[int, str] = field(default_factory=dict)
    checked: int = 0
    proven: int = 0
    undecided: int = 0
    refined: int = 0
    largest_error: float = 0.0

    def blame(self, which, why) -> None:
        """Steps (numbers, or a mask) that are bad."""
        for i in np.flatnonzero(which) if which.dtype == bool else which:
            self.bad.setdefault(int(i), why)

    def add(self, other: Verdict) -> None:
        """What was found of other aspects or steps."""
        for i, why in other.bad.items():
            self.bad.setdefault(i, why)
        self.proven += other.proven
        self.undecided += other.undecided
        self.refined += other.refined
        self.largest_error = max(self.largest_error, other.largest_error)
