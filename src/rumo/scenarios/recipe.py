"""A run as plain data: what it begins with, and what is other about it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from rumo.checks import as_mapping, printable
from rumo.errors import ArgumentError, UnknownNameError
from rumo.files import write_whole
from rumo.scenarios.arguments import Argument, Plain, arguments_of
from rumo.scenarios.bases import BASES
from rumo.scenarios.contents import by_content, located
from rumo.scenarios.files import flattened, read_tables, written
from rumo.scenarios.own import SEPARATOR, identity, own, split
from rumo.scenarios.parts import parts_of
from rumo.scenarios.settings import changed

SCENARIO = "scenario"
"""Table of a file that has a recipe."""
BASE = "base"


@dataclass(frozen=True)
class Recipe:
    """A run as plain data, that is sent, hashed and written to files as it is.

    Parameters
    ----------
    base : str
        What to begin with: a name in `BASES`, or one in a Python file, "my_file.py:make". That is a run, such as a
        `Scenario`, or a function of keyword arguments that returns one.
    settings : mapping of str to plain data
        What is other: arguments of the base, and settings of the run by their dotted names, see
        `rumo.scenarios.settings_of`, for which nested tables are the same. Arguments come first, whatever the order.

    Raises
    ------
    ArgumentError
        If there is no such base, or a name or value cannot be one. Whether settings fit is found out by `run`.
    """

    base: str
    settings: Mapping[str, Plain] = field(default_factory=dict[str, Plain])

    def __post_init__(self) -> None:
        printable(self.base, "base", f"one of {', '.join(BASES)}, or a file and a name in it such as my_file.py:make")
        if self.base not in BASES:
            if SEPARATOR not in self.base:
                raise UnknownNameError("base", self.base, BASES, "Or name a file, and a name in it: my_file.py:make.")
            file, name = split(self.base)
            # Other processes may be in another folder.
            object.__setattr__(self, "base", f"{file.resolve()}:{name}")
        settings = as_mapping(self.settings, "settings")
        for name, value in settings.items():
            printable(name, "settings")
            settings[name] = _plain(value, name)
        object.__setattr__(self, "settings", MappingProxyType(flattened(settings)))

    def __reduce__(self) -> tuple[type[Recipe], tuple[str, dict[str, Plain]]]:
        return Recipe, (self.base, dict(self.settings))

    @classmethod
    def from_toml(cls, path: str | Path) -> Recipe:
        """A recipe from the table `[scenario]` of a file; the names of files in it are relative to it.

        Raises
        ------
        ArgumentError
            If the file cannot be read, is no TOML, or has no such table.
        """
        return cls.of(read_tables(path).get(SCENARIO), Path(path).parent)

    @classmethod
    def of(cls, table: Any, folder: Path = Path()) -> Recipe:
        """A recipe from plain data: `base` beside the settings, whose tables may be nested."""
        if table is not None and not isinstance(table, Mapping):
            raise ArgumentError(SCENARIO, repr(table), f"a table: [{SCENARIO}]")
        if table is None or BASE not in table:
            raise ArgumentError(f"{SCENARIO}.{BASE}", "nothing", f'{BASE} = "paper", or another of {", ".join(BASES)}')
        settings = {key: value for key, value in table.items() if key != BASE}
        base = table[BASE]
        if isinstance(base, str) and base not in BASES and SEPARATOR in base:
            file, name = split(base)
            base = f"{folder / file}:{name}"
        recipe = cls(base, settings)
        return recipe.with_settings(recipe.located(recipe.settings, folder))

    def located(self, settings: Mapping[str, Plain], folder: Path = Path()) -> dict[str, Plain]:
        """Settings in which files that lie in a folder, named by arguments of the base, have their whole paths."""
        named = {name: located(settings[name], folder) for name in self.naming_files & settings.keys()}
        return {name: named.get(name, value) for name, value in settings.items()}

    @property
    def naming_files(self) -> frozenset[str]:
        """Settings, arguments of the base, that may name files."""
        return frozenset(name for name, argument in self.arguments.items() if argument.file)

    def to_toml(self, path: str | Path) -> None:
        """Write a file that `from_toml` reads; an old one is replaced.

        Raises
        ------
        OSError
            If the file cannot be written.
        """
        text = written({SCENARIO: self.plain})
        write_whole(path, lambda place: place.write_text(text, encoding="utf-8"))

    @property
    def plain(self) -> dict[str, Plain]:
        """As plain data, from which `of` makes it again."""
        return {BASE: self.base, **self.settings}

    def with_settings(self, more: Mapping[str, Plain]) -> Recipe:
        """The same with further settings, or others."""
        return replace(self, settings={**self.settings, **flattened(more)})

    @property
    def make(self) -> Callable[..., Any]:
        """What makes the run, of its arguments."""
        if self.base in BASES:
            return BASES[self.base]
        found = own(self.base)
        return found if callable(found) and not hasattr(found, "run") else _Found(found)

    @property
    def arguments(self) -> Mapping[str, Argument]:
        """Arguments of the base, by name."""
        return arguments_of(self.make)

    def run(self) -> Any:
        """The run: a `Scenario`, a `DriveRun`, or whatever else the base makes.

        Raises
        ------
        ArgumentError
            If a setting is unknown, or has a value that cannot be; the message begins with its name.
        """
        make, known = self.make, self.arguments
        arguments = {name: value for name, value in self.settings.items() if name in known and known[name].takes(value)}
        given = {name: known[name].checked(value, name) for name, value in arguments.items()}
        for name, argument in known.items():
            if argument.needed and name not in given:
                raise ArgumentError(name, "nothing", f"a value: {self.base} has no default for it")
        run = make(**given)
        if not callable(getattr(run, "run", None)):
            raise ArgumentError(BASE, f"{self.base!r}, which gives {run!r}", "a rumo.Scenario, or another run")
        others = {name: value for name, value in self.settings.items() if name not in arguments}
        if not others:
            return run
        try:
            return changed(run, others)
        except UnknownNameError as error:
            if error.argument in others and "." not in error.argument:  # it may have been meant as an argument
                raise UnknownNameError(error.argument, error.argument, (*known, *(parts_of(run) or ()))) from None
            raise

    @property
    def identity(self) -> dict[str, Plain]:
        """Plain data that differs if the run may: of files, what is in them, not where they are."""
        base: Plain = self.base if self.base in BASES else identity(self.base)
        named = {name: by_content(self.settings[name], {}) for name in self.naming_files & self.settings.keys()}
        return {BASE: base, "settings": {**self.settings, **named}}


@dataclass(frozen=True, eq=False)
class _Found:
    """A run that is there already, as a function of nothing."""

    run: Any

    def __call__(self) -> Any:
        return self.run


def _plain(value: Any, name: str) -> Plain:
    """A value as plain data; anything else raises."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, Mapping):
        return {str(key): _plain(item, f"{name}.{key}") for key, item in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [_plain(item, f"{name}.{i}") for i, item in enumerate(value)]
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise ArgumentError(name, repr(value), "a number, a text, true or false, or a list or a table of such")
