"""Settings of any run by dotted names: `problem.weights.p_y`, `sensors.noise.p_x`, `plant.mu`."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, is_dataclass
from math import isnan
from types import NoneType
from typing import Any, get_args

import numpy as np

from rumo.controllers import RealTimeIteration
from rumo.errors import ArgumentError, UnknownNameError
from rumo.registry import CONTROLLERS
from rumo.scenarios.arguments import Plain
from rumo.scenarios.kinds import KIND, as_hinted, item_hint, options_of
from rumo.scenarios.parts import Closed, hint_of, parts_of, with_parts

LEAVES = (bool, int, float, str)


def settings_of(run: Any) -> dict[str, Plain]:
    """All settings of a run that have plain values, by their dotted names.

    Parameters
    ----------
    run : Scenario, or a dataclass with one
        Such as a `DriveRun`, whose scenario's settings are its own.

    Returns
    -------
    dict of str to plain data
        None where there may be something, and is nothing.
    """
    return dict(_leaves("", run))


def _leaves(name: str, value: Any) -> Any:
    if value is None or isinstance(value, LEAVES):
        yield name, value
        return
    if isinstance(value, list) and all(isinstance(item, LEAVES) for item in value):
        yield name, value
        return
    for key, part in (parts_of(value) or {}).items():
        yield from _leaves(f"{name}.{key}" if name else key, part)


def changed(run: Any, settings: Mapping[str, Plain]) -> Any:
    """The same run with other settings.

    Parameters
    ----------
    run : Scenario, or a dataclass with one
        See `settings_of`.
    settings : mapping of str to plain data
        By dotted name. A table with `kind` makes a disturbance, a fault, an estimator of that class; "none" takes away
        what may be nothing.

    Raises
    ------
    UnknownNameError
        If there is no such setting.
    ArgumentError
        If a value cannot be; the message begins with the dotted name.
    """
    tree = _Tree()
    for name, value in settings.items():
        tree.add(name.split("."), value)
    first = tree.parts.pop("controller", None)  # it says which settings there are
    try:
        if first is not None:
            run = _with(run, _Tree(parts={"controller": first}), "", None)
            if CONTROLLERS.get(first.value) is not RealTimeIteration:
                tree.parts.pop("backend", None)  # of that alone: campaigns have several controllers
        return _with(run, tree, "", None) if tree.parts else run
    except ArgumentError as error:
        if error.argument.startswith(tuple(settings)):
            raise
        name = blamed(error, settings)
        words = f"{', '.join(settings)}: {error.argument}" if name is None else name
        raise ArgumentError(words, error.got, error.expected, error.cure) from None
    except (TypeError, ValueError) as error:
        raise ArgumentError(", ".join(settings), repr(dict(settings)), "values that fit", str(error)) from None


def blamed(error: ArgumentError, settings: Mapping[str, Plain]) -> str | None:
    """Which of some settings an error is of that knows it by another name; None if that cannot be told."""
    said = set(re.findall(r"\w+", f"{error.argument} {error.got}"))
    shared = {name: len(said & {*name.split("."), *_keys(value)}) for name, value in settings.items()}
    most = max(shared.values(), default=0)
    names = [name for name, count in shared.items() if count == most]
    return names[0] if len(names) == 1 and (most or len(settings) == 1) else None


def _keys(value: Plain) -> set[str]:
    """Keys of tables."""
    if isinstance(value, Mapping):
        return {*value}.union(*map(_keys, value.values()))
    return set[str]().union(*map(_keys, value)) if isinstance(value, list) else set()


@dataclass
class _Tree:
    """Values to be set, by the parts of their names: one for all of a part, and then others within it."""

    value: Any = None
    given: bool = False
    parts: dict[str, _Tree] = field(default_factory=dict)

    def add(self, path: list[str], value: Any) -> None:
        """Set a value at a path from here."""
        if not path:
            self.value, self.given = value, True
            return
        self.parts.setdefault(path[0], _Tree()).add(path[1:], value)


def _with(value: Any, tree: _Tree, where: str, kind: Any) -> Any:
    """A part, of a type as far as it is known, with what a tree says of the parts within it."""
    known = parts_of(value)
    if known is None:
        raise UnknownNameError(f"{where}.{next(iter(tree.parts))}", next(iter(tree.parts)), ())
    changes: dict[str, Any] = {}
    for name, inner in tree.parts.items():
        named = f"{where}.{name}" if where else name
        hint = item_hint(kind) if isinstance(value, Mapping) else hint_of(value, name)
        if name not in known and (isinstance(value, Closed) or not isinstance(value, Mapping) or not inner.given):
            raise UnknownNameError(named, name, known)
        part = known.get(name)
        if inner.given:
            part = _as_part(part, inner.value, hint, named)
        if inner.parts:
            part = _with(_begun(part, hint), inner, named, hint)
        changes[name] = part
    return with_parts(value, changes)


def _begun(part: Any, hint: Any) -> Any:
    """A part to set something in: where there is none, that of its type with nothing set."""
    if part is not None:
        return part
    kinds = [option for option in options_of(hint) if is_dataclass(option)]
    try:
        return kinds[0]() if len(kinds) == 1 else None  # pyright: ignore[reportCallIssue]
    except TypeError:
        return None


def _as_part(now: Any, value: Plain, hint: Any, name: str) -> Any:
    """Plain data as what is set by it, in place of what is there now."""
    if isinstance(value, np.generic):
        value = value.item()
    if value == "none" and (now is None or NoneType in get_args(hint)):
        return None
    if isinstance(value, Mapping | list) and not (isinstance(value, list) and isinstance(now, float | list)):
        return as_hinted(value, hint, name)
    if isinstance(value, str) and not isinstance(now, str):
        return as_hinted(value, hint, name) if now is None or hint is not None else _refused(name, value, now)
    if isinstance(value, bool) != isinstance(now, bool) and isinstance(now, LEAVES):
        _refused(name, value, now)
    if isinstance(now, str) and not isinstance(value, str):
        _refused(name, value, now)
    if isinstance(value, float) and isnan(value) and not (isinstance(now, float) and isnan(now)):
        raise ArgumentError(name, "nan", "a number")
    if isinstance(now, int) and not isinstance(now, bool) and isinstance(value, float):
        _refused(name, value, now)
    return float(value) if isinstance(now, float) and isinstance(value, int) else value


def _refused(name: str, value: Any, now: Any) -> Any:
    words = {bool: "true or false", int: "a whole number", float: "a number", str: "a text"}
    expected = words.get(type(now), f'a table with a line such as {KIND} = "{type(now).__name__}"')
    raise ArgumentError(name, repr(value), f"{expected}, such as {now!r}")
