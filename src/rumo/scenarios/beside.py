"""Modules that a Python file imports from beside itself: which these are, and how they are found at any time."""

from __future__ import annotations

import ast
import importlib
import os
import sys
from collections.abc import Generator, Mapping
from functools import lru_cache
from importlib.abc import MetaPathFinder
from importlib.machinery import EXTENSION_SUFFIXES, SOURCE_SUFFIXES, ModuleSpec, PathFinder
from pathlib import Path
from types import ModuleType
from typing import Any

from rumo.scenarios.contents import digest

INSTALLED = {"site-packages", "dist-packages"}
"""Folders of packages, of which a version is told and not what is in their files."""


def modules_beside(path: Path) -> dict[str, str]:
    """What a Python file imports from its own folder or below, and what these import there, wherever in them.

    It is read from the import statements, not from what is loaded: that depends on what else a process has done.
    Names that are put together by the program are not seen, and neither are those of Python's own modules.

    Parameters
    ----------
    path : Path
        Of the file.

    Returns
    -------
    dict of str to str
        SHA-256 of each file by the name of its module, in alphabetical order.
    """
    folder = path.parent
    found: dict[str, str] = {}
    there: dict[Path, set[str]] = {}
    waiting = [] if INSTALLED & {*folder.parts} else [(path, "")]
    while waiting:
        file, package = waiting.pop()
        for name in _imported(file.read_bytes(), package) if file.suffix in SOURCE_SUFFIXES else ():
            for module, place in _along(folder, name, there):
                if module not in found:
                    found[module] = digest(place)
                    waiting.append((place, module if place.stem == "__init__" else module.rpartition(".")[0]))
    return dict(sorted(found.items()))


def _along(folder: Path, name: str, there: dict[Path, set[str]]) -> Generator[tuple[str, Path]]:
    """Modules on the way to a dotted name, the last one perhaps no module, with their files.

    Of most names nothing is there: folders are listed once, into `there`.
    """
    parts = name.split(".")
    if parts[0] in sys.stdlib_module_names:
        return
    for i, part in enumerate(parts, 1):
        if folder not in there:
            there[folder] = {entry.partition(".")[0] for entry in os.listdir(folder)}
        if part not in there[folder]:
            return
        inner = folder / part
        suffixes = (*EXTENSION_SUFFIXES, *SOURCE_SUFFIXES)
        places = [*(inner / f"__init__{suffix}" for suffix in suffixes), *(folder / f"{part}{s}" for s in suffixes)]
        place = next((place for place in places if place.is_file()), None)
        if place is not None:
            yield ".".join(parts[:i]), place
        if not inner.is_dir() or (place is not None and place.parent == folder):
            return
        folder = inner


@lru_cache(maxsize=1024)
def _imported(text: bytes, package: str) -> tuple[str, ...]:
    """Dotted names that a module of a package imports; the last part of some may be what is in a module."""
    try:
        tree = ast.parse(text)
    except (SyntaxError, ValueError, RecursionError):  # it is said when the file is loaded
        return ()
    return tuple(dict.fromkeys(name for node in ast.walk(tree) for name in _names(node, package)))


def _names(node: ast.AST, package: str) -> list[str]:
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if isinstance(node, ast.ImportFrom):
        parts = package.split(".") if node.level else []
        parts = parts[: len(parts) - node.level + 1] if node.level else parts
        module = ".".join([part for part in (*parts, node.module or "") if part])
        return [f"{module}.{alias.name}".lstrip(".") for alias in node.names] if module else []
    if isinstance(node, ast.Call) and node.args:
        called, first = node.func, node.args[0]
        name = called.attr if isinstance(called, ast.Attribute) else getattr(called, "id", "")
        if name in ("import_module", "__import__") and isinstance(first, ast.Constant) and isinstance(first.value, str):
            return [] if first.value.startswith(".") else [first.value]
    return []


class _Beside(MetaPathFinder):
    """Finds what the file that is in use imports from beside it, and nothing else that lies there.

    A folder at the front of `sys.path` would hide Python's own modules from everyone, and two such files may each have
    a module of the same name: those of the one that is not in use are kept for when it is again.
    """

    def __init__(self) -> None:
        self._used: tuple[str, tuple[tuple[str, str], ...]] = ("", ())
        self._kept: dict[Any, dict[str, ModuleType]] = {}

    def use(self, path: Path, modules: Mapping[str, str]) -> None:
        """From now on, find those of a file, of which one with other content is another one."""
        wanted = (str(path.parent), tuple(modules.items()))
        if wanted == self._used:
            return
        if self not in sys.meta_path:
            sys.meta_path.insert(0, self)
        self._kept[self._used] = {name: sys.modules.pop(name) for name in [*sys.modules] if self._is_ours(name)}
        self._used = wanted
        sys.modules.update(self._kept.pop(wanted, {}))
        importlib.invalidate_caches()  # files may be newer than what is known of their folder

    def _is_ours(self, name: str) -> bool:
        folder, modules = self._used
        if name.partition(".")[0] not in {module.partition(".")[0] for module, _ in modules}:
            return False
        module = sys.modules[name]
        place = getattr(module, "__file__", None) or next(iter(getattr(module, "__path__", ())), "")
        return Path(folder) in Path(place).parents

    def find_spec(self, fullname: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        """See `importlib.abc.MetaPathFinder`."""
        folder, modules = self._used
        if path is not None or not any(name.partition(".")[0] == fullname for name, _ in modules):
            return None
        return PathFinder.find_spec(fullname, [folder], target)


BESIDE = _Beside()
"""Of this process."""
