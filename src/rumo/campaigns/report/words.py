"""Numbers and runs in words, as all parts of the report have them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rumo.report.tables import number


def percent(share: float | None) -> str:
    """A share in percent, without the sign: "93.5"."""
    return "-" if share is None else f"{100.0 * share:.1f}"


def percents(interval: Sequence[float] | None) -> str:
    """The ends of an interval of shares: "89.2 to 96.2"."""
    return "-" if interval is None else f"{percent(interval[0])} to {percent(interval[1])}"


def ends(interval: Sequence[float] | None) -> str:
    """The ends of an interval: "-0.012 to 0.004"."""
    return "-" if interval is None else f"{number(interval[0])} to {number(interval[1])}"


def share_words(found: Mapping[str, Any]) -> str:
    """A share of runs, and its interval: "187 of 200 drives, 93.5 % (95 % interval 89.2 to 96.2 %)"."""
    drives = "drive" if found["runs"] == 1 else "drives"
    return (
        f"{number(found['passed'])} of {number(found['runs'])} {drives}, {percent(found['share'])} % "
        f"(95 % interval {percents(found['interval'])} %)"
    )


def settings_words(settings: Mapping[str, Any]) -> str:
    """The settings of a draw: "speed 10, plant.mu 0.712"."""
    return ", ".join(f"{name} {value_words(value)}" for name, value in settings.items())


def value_words(value: Any) -> str:
    """The value of a setting, numbers to four digits, several values beside each other."""
    if isinstance(value, Mapping):
        return settings_words(value)
    if isinstance(value, list | tuple):
        return ", ".join(map(value_words, value))
    if isinstance(value, float) and value == int(value) and abs(value) < 1e6:
        value = int(value)
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def rerun_command(folder: str, key: str) -> str:
    """What repeats a run."""
    quoted = f'"{folder}"' if " " in folder else folder
    return f"rumo rerun {quoted} {key}"


def capital(sentence: str) -> str:
    """A sentence from its first letter on."""
    return sentence[:1].upper() + sentence[1:]
