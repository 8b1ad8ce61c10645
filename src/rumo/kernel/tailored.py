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
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from platformdirs import user_cache_path

from rumo.kernel._core import __file__ as extension
from rumo.kernel._core import build as build_name
from rumo.kernel.description import Description
from rumo.kernel.straight import composition_source, elimination_source

logger = logging.getLogger("rumo")

SOURCES = Path(extension).parent / "core"
PATIENCE = 120.0
"""Time that a compiler may take [s]."""
LONGEST = 4000
"""Instructions of wide models that are worth compiling: some seconds, for a tenth of their time."""
SUFFIX = ".dll" if os.name == "nt" else ".so"

COMMON = ("-std=c11", "-shared", "-ffp-contract=fast", "-fno-math-errno", "-fno-trapping-math", "-w")
GCC = ("-march=native", "-O2", "-ftree-vectorize", "-fvect-cost-model=dynamic", "-fpeel-loops")
"""As fast as -O3, and compiled in two thirds of its time."""
WIDE = ("-mprefer-vector-width=512",) if platform.machine().lower() in ("x86_64", "amd64") else ()
CLANG = ("-march=native", "-O3")
PLAIN = ("-O2",)
"""For compilers that know none of the others."""


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


def tailored(description: Description, solver: str | None = None) -> Build:
    """The build for a problem, compiled if the cache has none; the portable one if that is not possible or no gain.

    Parameters
    ----------
    description : Description
        What the core needs to know.
    solver : str or None
        A file that defines another stage solver, see `solve/stage_solver.h`.
    """
    length = len(description.tape.code) + len(description.inner_tape.code)
    if description.values["elimination_blocks"] == 0 and length > LONGEST:
        logger.info("The portable build of the core is used: compiling so wide a model takes long and gains little.")
        return portable()
    try:
        sources = _sources(description, solver)
        command = compiler()
        name = _fingerprint(sources, command)
        if name in _hopeless:
            raise CompilerError(_hopeless[name])
        folder = cache_folder()
        for library in sorted(folder.glob(f"{name}-*{SUFFIX}")):
            build = _kept(library)
            if build is not None:
                return build
            library.unlink(missing_ok=True)
        logger.info("Compiling the core for this problem, which is kept: it takes some seconds, once.")
        try:
            return _compile(sources, command, folder, name)
        except CompilerError as error:
            _hopeless[name] = str(error)  # the next controller need not wait for it again
            raise
    except (CompilerError, OSError, ValueError) as error:
        _report(str(error))
        return portable()


_hopeless: dict[str, str] = {}
"""Why a build failed in this process, by its name."""


@cache
def _report(reason: str) -> None:
    """Once for each reason: a warning for every controller would say nothing new."""
    logger.warning("The portable build of the core is used, up to twice as slow: %s", reason)


def cache_folder() -> Path:
    """Where tailored builds are kept: the environment variable RUMO_CACHE, or the user's cache folder."""
    folder = Path(os.environ.get("RUMO_CACHE") or user_cache_path("rumo"))
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _sources(description: Description, solver: str | None = None) -> tuple[str, str]:
    """One translation unit, with sizes and core, and the model that it includes."""
    return (
        f"""\
#define RUMO_TAILORED
#define RUMO_SIZES {", ".join(str(size) for size in description.sizes)}
#define RUMO_TABLE rumo_core_tailored
#define RUMO_BUILD "tailored"
#define RUMO_EVALUATE "model.h"
#define RUMO_SPARSE {int(description.values["elimination_sparse"].any())}
#define RUMO_WIDE {int(description.values["elimination_blocks"] == 0)}
{f'#define RUMO_SOLVER "{solver}"' if solver else ""}
#include "core.c"
""",
        model_source(description),
    )


def model_source(description: Description) -> str:
    """The file RUMO_EVALUATE of core.c: the model, how its unknowns are eliminated, and substeps put together."""
    horizon = description.sizes[0]
    tapes = {"evaluate": description.tape, "evaluate_inner": description.inner_tape}
    functions = [tape.source(name, horizon) for name, tape in tapes.items()]
    functions.append(elimination_source(description.values, "eliminate_in_order", horizon))
    functions.append(composition_source(description.values, "compose_in_code", horizon))
    return "".join(functions)


def compiler() -> tuple[str, ...]:
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


def _compile(sources: tuple[str, str], command: tuple[str, ...], folder: Path, name: str) -> Build:
    """Compile beside the target and move there in one go: no process ever sees half a library.

    The target's name ends in the digest of what is in it, so that a damaged file is noticed.
    """
    with tempfile.TemporaryDirectory(dir=folder, prefix="build-") as own:
        unit, model, made = Path(own, "unit.c"), Path(own, "model.h"), Path(own, f"library{SUFFIX}")
        unit.write_text(sources[0], encoding="utf-8")
        model.write_text(sources[1], encoding="utf-8")
        includes = [f"-I{path}" for path in (SOURCES / "include", SOURCES / "src", own)]
        system = [] if os.name == "nt" else ["-fPIC", "-lm"]
        complaint = ""
        for tuning in ((*GCC, *WIDE) if _is_gcc(command) else CLANG, PLAIN):
            arguments = [*command, *COMMON, *tuning, *includes, "-o", str(made), str(unit), *system]
            returned, printed = _run(arguments)
            if returned == 0 and made.exists():
                break
            complaint = complaint or printed.strip()[-500:] or f"it made no library, and ended with {returned}"
        else:
            raise CompilerError(f"{shlex.join(command)} failed: {complaint}")
        try:
            loaded = _load(made)
        except (OSError, ValueError) as error:
            raise CompilerError(f"{shlex.join(command)} made a library that cannot be used: {error}") from None
        os.replace(made, folder / f"{name}-{_digest(made.read_bytes())}{SUFFIX}")
        return loaded


def _run(arguments: Sequence[str]) -> tuple[int, str]:
    """Run a compiler; what it returned and printed. If it hangs, it is ended with all that it has started."""
    try:
        process = subprocess.Popen(
            arguments,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
            errors="replace",
            start_new_session=True,
        )
    except OSError as error:
        raise CompilerError(f"{arguments[0]}: {error}") from None
    with process:
        try:
            printed, _ = process.communicate(timeout=PATIENCE)
        except BaseException as error:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL) if os.name == "posix" else process.kill()
            if isinstance(error, subprocess.TimeoutExpired):
                raise CompilerError(f"{arguments[0]} did not come to an end within {PATIENCE:g} s.") from None
            raise
    return process.returncode, printed


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:16]


def _kept(library: Path) -> Build | None:
    """A library of the cache; None if it is damaged, or of another machine."""
    try:
        if library.stem.endswith(_digest(library.read_bytes())):
            return _load(library)
    except (OSError, ValueError):
        pass
    return None


def _load(library: Path) -> Build:
    loaded = ctypes.CDLL(str(library))
    table = ctypes.addressof(ctypes.c_char.in_dll(loaded, "rumo_core_tailored"))
    build_name(table)  # raises if it is of another version
    return Build("tailored", table, loaded)


@cache
def _is_gcc(command: tuple[str, ...]) -> bool:
    return "Free Software Foundation" in _run([*command, "--version"])[1]


@cache
def _machine() -> str:
    """What a library depends on besides its sources: a cache may be shared by machines."""
    system = f"{platform.machine()} {platform.system()} {' '.join(platform.libc_ver())}"
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return f"{system} {next(line for line in lines if line.startswith(('flags', 'Features')))}"
    except (OSError, StopIteration):
        return f"{system} {platform.processor()}"


def _fingerprint(sources: tuple[str, str], command: tuple[str, ...]) -> str:
    digest = hashlib.sha256()
    files = sorted(path for path in SOURCES.rglob("*") if path.is_file())
    for text in (*sources, shlex.join(command), _machine(), repr((COMMON, GCC, WIDE, CLANG, PLAIN))):
        digest.update(text.encode())
    for path in files:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:32]
