"""What became of all drives of a controller, fault by fault."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

from rumo.studies.faults.outcome import Drive
from rumo.studies.faults.troubles import FAULTS

WHOLE = "whole"
"""In place of a number of bad samples: all of the drive."""

Drives = Mapping[float, Mapping[int | str, Mapping[int, Drive]]]
"""By speed, number of bad samples, and seed."""
Results = Mapping[str, Mapping[str, Drives]]
"""By controller and fault."""


def by_fault(drives: Mapping[str, Drives]) -> dict[str, dict[str, Any]]:
    """What came of a controller's drives, by fault: see `together`."""
    return {fault: {"title": FAULTS[fault].title, **together(of_fault)} for fault, of_fault in drives.items()}


def together(drives: Drives) -> dict[str, Any]:
    """What came of the drives through one fault; None where nothing, or not every drive, says.

    Returns
    -------
    dict
        `drives`: how many. `bad_commands`, `exceptions`, `lost`, `told`, `status_counts`: sums. `largest_error_m`: the
        largest of any speed and seed, by number of bad samples. `samples_to_recover`, `recovery_s`, `told_after_s`: the
        longest; None if a drive never did.
    """
    counts = [
        (count, drive.outcome)
        for of_speed in drives.values()
        for count, of in of_speed.items()
        for drive in of.values()
    ]
    every = [each for _, each in counts]
    statuses = sum((Counter(each["status_counts"]) for each in every), Counter[str]())
    return {
        "drives": len(every),
        **{name: sum(each[name] or 0 for each in every) for name in ("bad_commands", "exceptions", "lost", "told")},
        "largest_error_m": {
            str(count): _most((each["largest_error_m"] for other, each in counts if other == count), some=True)
            for count in dict.fromkeys(count for count, _ in counts)
        },
        **{name: _most(each[name] for each in every) for name in ("samples_to_recover", "recovery_s", "told_after_s")},
        "status_counts": dict(statuses),
    }


def _most(values: Iterable[float | None], *, some: bool = False) -> float | None:
    """The largest; None if any is, or if `some` may be, all are."""
    every = list(values)
    known = [value for value in every if value is not None]
    return max(known) if known and (some or len(known) == len(every)) else None
