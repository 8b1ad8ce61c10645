"""What is other about plain data, in words."""

from __future__ import annotations

import json
from collections.abc import Generator, Mapping
from typing import Any

MOST = 4
"""Differences that are named; the others are counted."""
LONGEST = 60
"""Characters of a value."""
CONTENT = "sha256"
"""Key of what is in a file."""


def differences(before: Mapping[str, Any], now: Mapping[str, Any]) -> str:
    """Which entries differ, what they were and are: "scenario.settings.speed was 8.0, is 9.0".

    Parameters
    ----------
    before, now : mapping
        Plain data. Tables within are gone through.
    """
    found = list(_differences(before, now, ""))
    more = [f"and {len(found) - MOST} more"] if len(found) > MOST else []
    return "; ".join([*found[:MOST], *more])


def _differences(before: Mapping[str, Any], now: Mapping[str, Any], prefix: str) -> Generator[str]:
    for key in dict.fromkeys((*before, *now)):
        name, was, is_ = f"{prefix}{key}", before.get(key), now.get(key)
        if was == is_ and (key in before) == (key in now):
            continue
        if key == CONTENT:
            yield f"{prefix.rstrip('.') or 'the file'} has other content"
        elif isinstance(was, Mapping) and isinstance(is_, Mapping):
            yield from _differences(was, is_, f"{name}.")
        elif isinstance(was, list) and isinstance(is_, list):
            yield f"{name} {_of_lists(was, is_)}"
        elif key not in before or key not in now:
            yield f"{name} was {_words(was, key in before)}, is {_words(is_, key in now)}"
        else:
            yield f"{name} was {_words(was)}, is {_words(is_)}"


def _of_lists(before: list[Any], now: list[Any]) -> str:
    gone, new = [item for item in before if item not in now], [item for item in now if item not in before]
    if not gone and not new:
        return "in another order"
    return ", ".join(f"{verb} with {_words(items)}" for verb, items in (("was", gone), ("is", new)) if items)


def _words(value: Any, there: bool = True) -> str:
    text = _text(value) if there else "not there"
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."


def _text(value: Any) -> str:
    if isinstance(value, Mapping) and CONTENT in value:
        return f"file {value[CONTENT][:8]}"
    if isinstance(value, list):
        return ", ".join(map(_text, value))
    return "nothing" if value is None else json.dumps(value, default=str)
