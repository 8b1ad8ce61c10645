"""How far a campaign has come."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Standing:
    """How far a campaign has come, since it was started the last time.

    Attributes
    ----------
    every : int
        Runs of the campaign.
    before : int
        Of these, runs that were stored when it was started.
    done : int
        Of these, runs that have become rows, those before included.
    failed : int
        Of the runs since the start, those that raised, crashed or took too long.
    seconds : float
        Time since the start [s].
    """

    every: int
    before: int
    done: int
    failed: int
    seconds: float

    @property
    def rate(self) -> float:
        """Runs in a second; 0 if nothing is known of it."""
        return (self.done - self.before) / self.seconds if self.seconds > 0.0 else 0.0

    @property
    def left(self) -> float | None:
        """Time that is left [s]; None if nothing is known of it."""
        return (self.every - self.done) / self.rate if self.rate else None

    def __str__(self) -> str:
        failed = f", {self.failed} failed" if self.failed else ""
        return f"{self.done}/{self.every} runs{failed}{self._pace}"

    @property
    def _pace(self) -> str:
        rate = f", {_digits(self.rate)}/s" if self.rate else ""
        return rate + (f", {in_words(self.left)} left" if self.left else "")


@dataclass(frozen=True)
class Beginning(Standing):
    """How far the first runs of a campaign have come, which say how long the others will take."""

    def __str__(self) -> str:
        return f"{self.done}/{self.every} runs; the first ones say how long all take"


@dataclass(frozen=True)
class Searching(Standing):
    """How far a search has come, of which `every` is its trials.

    Attributes
    ----------
    best : str
        What the best so far comes to, in words.
    """

    best: str = ""

    def __str__(self) -> str:
        best = f", best so far {self.best}" if self.best else ""
        return f"{self.done}/{self.every} trials{self._pace}{best}"


def in_words(seconds: float) -> str:
    """A time for people: 40 s, 12 min, 3 h 20 min."""
    minutes = round(seconds / 60.0)
    if seconds < 99.5:
        return f"{seconds:.0f} s"
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60} min"


def _digits(rate: float) -> str:
    return f"{rate:.0f}" if rate >= 10.0 else f"{rate:.2g}"
