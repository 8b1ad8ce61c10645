"""From a disturbance that violates something to the smallest one of its kind."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from rumo.campaigns.falsification.specification import Falsification
from rumo.campaigns.tasks.task import Row
from rumo.scenarios import Plain

HALVINGS = 10
"""Of the way from nothing to what was found."""

Drive = Callable[[Mapping[str, Plain]], Row]
"""From settings of a disturbance to the row of its drive."""


@dataclass(frozen=True)
class Found:
    """A disturbance that violates something.

    Attributes
    ----------
    settings : mapping of str to plain data
        What it is.
    size : float
        How large; 0 if no disturbance is needed at these settings.
    violated : tuple of str
        Names of the criteria.
    row : dict
        Of its drive.
    without : dict
        Row of the drive without it, all else the same.
    holds_at : float, optional
        The largest size, on the way from nothing to it, that was driven and violates nothing; None if there is none.
    held : dict, optional
        Row of that drive.
    """

    settings: Mapping[str, Plain]
    size: float
    violated: tuple[str, ...]
    row: Row
    without: Row
    holds_at: float | None = None
    held: Row | None = None


def shrunk(what: Falsification, drive: Drive, settings: Mapping[str, Plain]) -> Found:
    """The smallest disturbance of the same kind that violates something, as far as it is looked for.

    The way from nothing to the disturbance is halved; where several settings have a size, then that of each alone, the
    others as they are: none of what is left could be smaller by itself. That on each such way what holds and what
    violates something meet at one place is taken for granted.

    Parameters
    ----------
    what : Falsification
        What is looked for.
    drive : callable
        From settings to a row.
    settings : mapping of str to plain data
        Of a disturbance that violates something.
    """
    without = what.smaller(settings, 0.0)
    calm = drive(without)
    if violated := what.violated(calm):
        return Found(without, 0.0, violated, calm, calm)
    found, held = _halved(what, drive, dict(settings), tuple(what.size))
    for name in what.size if len(what.size) > 1 else ():
        lesser, other = _halved(what, drive, found, (name,))
        if lesser != found or what.size_of(other) > what.size_of(held):
            found, held = lesser, other
    row = drive(found)
    return Found(found, what.size_of(found), what.violated(row) or (), row, calm, what.size_of(held), drive(held))


def _halved(
    what: Falsification, drive: Drive, settings: dict[str, Plain], names: tuple[str, ...]
) -> tuple[dict[str, Plain], dict[str, Plain]]:
    """The least that violates something, and the most that holds, between a disturbance and none in some settings."""

    def at(share: float) -> dict[str, Plain]:
        nearer = what.smaller(settings, share)
        return {**settings, **{name: nearer[name] for name in names}}

    low, high, held, found = 0.0, 1.0, at(0.0), settings
    if held != found and what.violated(drive(held)):
        return held, what.smaller(held, 0.0)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        tried = at(middle)
        if tried == found:
            high = middle  # whole numbers: there may be another one below
        elif tried == held:
            low = middle
        elif what.violated(drive(tried)):
            high, found = middle, tried
        else:
            low, held = middle, tried
    return found, held
