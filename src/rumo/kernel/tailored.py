"""The core compiled for one problem on first use and kept in a cache; the portable build where that fails."""

from __future__ import annotations

import ctypes
import hashlib
import importlib.util
import logging
import os
import platform
import shlex
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from platformdirs import user_cache_path

from rumo.kernel import _core
from rumo.kernel.description import Description

logger = logging.getLogger("rumo")

SOURCES = Path(_core.__file__).parent / "core"
PATIENCE = 120.0
"""Time that a compiler may take [s]."""

COMMON = ("-std=c11", "-shared", "-march=native", "-ffp-contract=fast", "-fno-math-errno", "-fno-trapping-math", "-w")
GCC = ("-O2", "-ftree-vectorize", "-fvect-cost-model=dynamic", "-fpeel-loops", "-mprefer-vector-width=512")
"""As fast as -O3, and compiled in two thirds of its time."""
CLANG = ("-O3",)


@dataclass(frozen=True)
class Build:
    """A build of the core: its name, the address of its table of functions (0: the one in the package), its library."""

    name: str
    table: int = 0
    library: Any = None


class CompilerError(Exception):
    """No compiler, or one that does not work here."""


def portable() -> Build:
    """The build that came with the package."""
    return Build("portable")


def tailored(description: Description) -> Build:
    """The build for a problem, compiled if the cache has none; the portable one if that is not possible."""
    try:
        sources = _sources(description)
        command = _compiler()
        name = _fingerprint(sources, command)
        folder = cache_folder()
        library = folder / f"{name}{'.dll' if os.name == 'nt' else '.so'}"
        if not library.exists():
            _compile(sources, command, library)
        try:
            return _load(library)
        except (OSError, ValueError):  # damaged, or of another machine: make it again
            library.unlink(missing_ok=True)
            _compile(sources, command, library)
            return _load(library)
    except (CompilerError, OSError, ValueError) as error:
        logger.warning("The portable build of the core is used, up to twice as slow: %s", error)
        return portable()


def cache_folder() -> Path:
    """Where tailored builds are kept: the environment variable RUMO_CACHE, or the user's cache folder."""
    folder = Path(os.environ.get("RUMO_CACHE") or user_cache_path("rumo"))
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _sources(description: Description) -> tuple[str, str]:
    """One translation unit, with sizes and core, and the model that it includes."""
    return (
        f"""\
#define RUMO_TAILORED
#define RUMO_SIZES {", ".join(str(size) for size in description.sizes)}
#define RUMO_TABLE rumo_core_tailored
#define RUMO_BUILD "tailored"
#define RUMO_EVALUATE "model.h"
#include "core.c"
""",
        description.tape.source(description.sizes[0]),
    )


def _compiler() -> tuple[str, ...]:
    """The command that compiles C: $CC, cc, gcc or clang, else Zig's if the package ziglang is installed."""
    named = os.environ.get("CC")
    if named:
        return tuple(shlex.split(named))
    for name in ("cc", "gcc", "clang"):
        found = shutil.which(name)
        if found:
            return (found,)
    if importlib.util.find_spec("ziglang"):
        return (sys.executable, "-m", "ziglang", "cc")
    raise CompilerError("no C compiler was found (cc, gcc, clang, or the package ziglang).")


def _compile(sources: tuple[str, str], command: tuple[str, ...], library: Path) -> None:
    """Compile beside the target and move there in one go: no process ever sees half a library."""
    with tempfile.TemporaryDirectory(dir=library.parent, prefix="build-") as name:
        folder = Path(name)
        unit, model = sources
        (folder / "unit.c").write_text(unit, encoding="utf-8")
        (folder / "model.h").write_text(model, encoding="utf-8")
        tuning = GCC if _is_gcc(command) else CLANG
        includes = [f"-I{SOURCES / part}" for part in ("include", "src")]
        position = [] if os.name == "nt" else ["-fPIC"]
        arguments = [*command, *COMMON, *tuning, *position, *includes, f"-I{folder}", "-o", str(folder / "library")]
        arguments += [str(folder / "unit.c")] + ([] if os.name == "nt" else ["-lm"])
        try:
            done = subprocess.run(arguments, capture_output=True, text=True, timeout=PATIENCE, check=False)
        except (OSError, subprocess.TimeoutExpired) as error:
            raise CompilerError(f"{command[0]}: {error}") from None
        if done.returncode != 0:
            raise CompilerError(f"{shlex.join(command)} failed: {done.stderr.strip()[-500:]}")
        os.replace(folder / "library", library)


def _load(library: Path) -> Build:
    loaded = ctypes.CDLL(str(library))
    table = ctypes.addressof(ctypes.c_char.in_dll(loaded, "rumo_core_tailored"))
    _core.build(table)  # raises if it is of another version
    return Build("tailored", table, loaded)


@cache
def _is_gcc(command: tuple[str, ...]) -> bool:
    try:
        answer = subprocess.run([*command, "--version"], capture_output=True, text=True, timeout=PATIENCE, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise CompilerError(f"{command[0]}: {error}") from None
    return "Free Software Foundation" in answer.stdout


@cache
def _machine() -> str:
    """What `-march=native` depends on: a cache may be shared by machines."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line for line in lines if line.startswith(("flags", "Features")))
    except (OSError, StopIteration):
        return f"{platform.machine()} {platform.processor()}"


def _fingerprint(sources: tuple[str, str], command: tuple[str, ...]) -> str:
    digest = hashlib.sha256()
    files = sorted(path for path in SOURCES.rglob("*") if path.is_file())
    for text in (*sources, shlex.join(command), _machine(), repr((COMMON, GCC, CLANG))):
        digest.update(text.encode())
    for path in files:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:32]
