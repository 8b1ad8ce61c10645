"""Modules that a Python file imports from beside itself: which these are, and how they are found at any time."""

from __future__ import annotations

import ast
import importlib
import os
import sys
from collections.abc import Generator, Iterable, Mapping
from functools import lru_cache
from importlib.abc import MetaPathFinder
from importlib.machinery import EXTENSION_SUFFIXES, SOURCE_SUFFIXES, ModuleSpec, PathFinder
from importlib.util import resolve_name
from pathlib import Path
from types import ModuleType
from typing import Any

from rumo.scenarios.contents import digest
from rumo.scenarios.loading import as_written

LISTED, EVERY = "__all__", "*"
IMPORTERS = ("import_module", "__import__")
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


def _along(top: Path, name: str, there: dict[Path, set[str]]) -> Generator[tuple[str, Path]]:
    """Modules on the way to a dotted name, the last one perhaps no module, or all of a package's, with their files.

    Of most names nothing is there: folders are listed once, into `there`.
    """
    folder, parts, place = top, name.split("."), None
    if parts[0] in sys.stdlib_module_names:
        return
    for i, part in enumerate(parts, 1):
        if folder not in there:
            there[folder] = {entry.partition(".")[0] for entry in os.listdir(folder)}
        if part == EVERY and place is not None:
            listed = _listed(place.read_bytes()) if place.suffix in SOURCE_SUFFIXES else None
            for each in sorted(there[folder] - {"__init__"}) if listed is None else listed:
                yield from _along(top, ".".join([*parts[:-1], each]), there)
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
    return tuple(dict.fromkeys(name for node in _nodes(text) for name in _names(node, package)))


@lru_cache(maxsize=1024)
def _listed(text: bytes) -> tuple[str, ...] | None:
    """What a package lists to be imported with all else of it; None if only the program knows."""
    told, listed = 0, list[str]()
    for node in _nodes(text):
        told += LISTED in (getattr(node, "id", ""), getattr(node, "name", ""), getattr(node, "value", ""))
        if isinstance(node, ast.Assign | ast.AnnAssign | ast.AugAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            if [getattr(target, "id", "") for target in targets] == [LISTED] and node.value is not None:
                try:
                    listed += map(str, ast.literal_eval(node.value))
                except (ValueError, TypeError):  # put together by the program
                    continue
                told -= 1
    return None if told else tuple(listed)


def _nodes(text: bytes) -> Iterable[ast.AST]:
    try:
        return ast.walk(ast.parse(text))
    except (SyntaxError, ValueError, RecursionError):  # it is said when the file is loaded
        return ()


def _names(node: ast.AST, package: str) -> list[str]:
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if isinstance(node, ast.ImportFrom):
        module = _absolute("." * node.level + (node.module or ""), package)
        return [f"{module}.{alias.name}" for alias in node.names] if module else []
    if isinstance(node, ast.Call):
        called = node.func
        given = dict(zip(("name", "package"), node.args, strict=False))
        given |= {each.arg: each.value for each in node.keywords if each.arg}
        if (called.attr if isinstance(called, ast.Attribute) else getattr(called, "id", "")) in IMPORTERS:
            name, base = (_text(given.get(part)) for part in ("name", "package"))
            return [_absolute(name, base or package)] if name else []
    return []


def _text(node: ast.AST | None) -> str:
    """A text that is in the program as such; nothing of another expression, such as `__package__`."""
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""


def _absolute(name: str, package: str) -> str:
    """A dotted name that may begin with dots, of a package; nothing where there is none."""
    try:
        return resolve_name(name, package)
    except ImportError:  # beyond the file's folder
        return ""


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
        if fullname.partition(".")[0] not in {name.partition(".")[0] for name, _ in modules}:
            return None
        if path is not None and not any(Path(folder) in Path(place).parents for place in path):
            return None
        return as_written(PathFinder.find_spec(fullname, [folder] if path is None else path, target))


BESIDE = _Beside()
"""Of this process."""
