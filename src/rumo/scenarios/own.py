"""Runs of the user's own, from a file: `my_file.py:make`."""

from __future__ import annotations

import hashlib
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

from rumo.errors import ArgumentError, UnknownNameError

SEPARATOR = ".py:"


def split(base: str) -> tuple[Path, str]:
    """File and name of a base such as "my_file.py:make"."""
    file, _, name = base.rpartition(":")
    return Path(file), name


def digest(path: Path) -> str:
    """SHA-256 of what a file holds.

    Raises
    ------
    ArgumentError
        If it cannot be read.
    """
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise ArgumentError("base", f"'{path}' ({error.strerror})", "a Python file that can be read") from None


def own(base: str) -> Any:
    """What a file calls by a name; the file is run once for each content that it has.

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
    name = f"rumo_own_{digest(path)[:16]}_{path.stem}"
    if name in sys.modules:
        return sys.modules[name]
    spec = spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    folder = str(path.resolve().parent)
    sys.modules[name] = module
    sys.path.insert(0, folder)  # for what it imports from beside it
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[name]
        got = f"'{path}', which raises {type(error).__name__}: {error}"
        raise ArgumentError("base", got, "a Python file that can be imported") from error
    finally:
        sys.path.remove(folder)
    return module
