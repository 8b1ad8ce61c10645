"""Runs of the user's own, from a file: `my_file.py:make`."""

from __future__ import annotations

import hashlib
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

from rumo.errors import ArgumentError, UnknownNameError
from rumo.scenarios.arguments import Plain
from rumo.scenarios.beside import BESIDE, modules_beside
from rumo.scenarios.contents import digest
from rumo.scenarios.loading import AsWritten

SEPARATOR = ".py:"


def split(base: str) -> tuple[Path, str]:
    """File and name of a base such as "my_file.py:make"."""
    file, _, name = base.rpartition(":")
    return Path(file), name


def identity(base: str) -> dict[str, Plain]:
    """Plain data that differs if what the file, or a module that it imports from beside itself, holds does.

    Raises
    ------
    ArgumentError
        If a file cannot be read.
    """
    path, name = split(base)
    found: dict[str, Plain] = {"sha256": digest(path), "name": name}
    modules = modules_beside(path)
    if modules:
        found["modules"] = {module: {"sha256": content} for module, content in modules.items()}
    return found


def own(base: str) -> Any:
    """What a file calls by a name; the file is run once for each content that it and its modules have.

    Raises
    ------
    ArgumentError
        If the file cannot be read or run, or has no such name.
    """
    path, name = split(base)
    module = _module(path)
    if not hasattr(module, name):
        known = [known for known in vars(module) if not known.startswith("_")]
        raise UnknownNameError(f"base: a name in {path}", name, known)
    return getattr(module, name)


def _module(path: Path) -> ModuleType:
    # What its classes are called in pickles has to be found again, so the module has a name of its own.
    content, modules = digest(path), modules_beside(path)
    if modules:
        content = hashlib.sha256(repr((content, modules)).encode()).hexdigest()
    name = f"rumo_own_{content[:16]}_{path.stem}"
    BESIDE.use(path, modules)
    if name in sys.modules:
        return sys.modules[name]
    loader = AsWritten(name, str(path))
    spec = spec_from_file_location(name, path, loader=loader)
    assert spec is not None
    module = module_from_spec(spec)
    folder = str(path.resolve().parent)
    if folder not in sys.path:  # for imports by names that only the program knows; last, so that it hides nothing
        sys.path.append(folder)
    sys.modules[name] = module
    try:
        loader.exec_module(module)
    except Exception as error:
        del sys.modules[name]
        got = f"'{path}', which raises {type(error).__name__}: {error}"
        raise ArgumentError("base", got, "a Python file that can be imported") from error
    return module
