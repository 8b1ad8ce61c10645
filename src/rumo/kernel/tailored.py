"""The core compiled for one problem on first use and kept in a cache; the portable build where that fails."""

from __future__ import annotations

import ctypes
import hashlib
import logging
import os
import platform
import shlex
import shutil
import signal
import site
import subprocess
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from errno import ENOSPC
from functools import cache
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Any

from rumo.kernel._core import VERSION
from rumo.kernel._core import __file__ as extension
from rumo.kernel._core import build as build_name
from rumo.kernel.cache import CURE, SUFFIX, Cache, CacheError, open_cache
from rumo.kernel.description import Description
from rumo.kernel.elimination import LANES
from rumo.kernel.straight import composition_source, elimination_source
from rumo.kernel.system import SystemProgram
from rumo.version import __version__

logger = logging.getLogger("rumo")

SOURCES = Path(extension).parent / "core"
PATIENCE = 120.0
"""Time that a compiler may take [s]."""
LONGEST = 4000
"""Instructions of wide models that are worth compiling: some seconds, for a tenth of their time."""

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
    return _built(_sources(description, solver), _load, "problem")


def tailored_right_side(program: SystemProgram) -> Build:
    """The right-hand side of a system as code, compiled if the cache has none; its table is a `rumo_right_side`.

    The portable build, which runs tapes, if that is not possible or no gain.
    """
    if len(program.jacobian.code) > LONGEST:
        logger.info("A right-hand side of so many operations is not compiled: it takes long and gains little.")
        return portable()
    unit = '#define RUMO_TAILORED\n#define RUMO_EVALUATE "model.h"\n#include "integrate/tailored.c"\n'
    tapes = {"evaluate": program.jacobian, "evaluate_inner": program.rates}
    model = "".join(tape.source(name, LANES) for name, tape in tapes.items())
    return _built((unit, model), _load_right_side, "plant")


def _built(sources: tuple[str, str], load: Callable[[Path], Build], kind: str) -> Build:
    """What is made of sources, from the cache or compiled; the portable build where that fails."""
    try:
        command = compiler()
        name = _fingerprint(sources, command)
        if name in _hopeless:
            raise CompilerError(_hopeless[name])
        kept = open_cache()
        found = _found(kept, name, load)
        if found is not None:
            return found
        with kept.alone(name, PATIENCE):
            found = _found(kept, name, load)  # another process may have built it meanwhile
            if found is not None:
                return found
            logger.info("Compiling the core for this %s, which is kept: it takes some seconds, once.", kind)
            try:
                return _compile(sources, command, kept, name, load)
            except CompilerError as error:
                _hopeless[name] = str(error)  # the next one need not wait for it again
                raise
    except (CompilerError, CacheError, OSError, ValueError) as error:
        _report(str(error))
        return portable()


def _found(kept: Cache, name: str, load: Callable[[Path], Build]) -> Build | None:
    """A build that the cache has."""
    for library in kept.find(name):
        try:
            return load(library)
        except (OSError, ValueError):  # it does not work on this machine
            kept.remove(library)
    return None


_hopeless: dict[str, str] = {}
"""Why a build failed in this process, by its name."""


@cache
def _report(reason: str) -> None:
    """Once for each reason: a warning for every controller would say nothing new."""
    logger.warning("The portable build of the core is used, up to twice as slow: %s", reason)


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
    """The command that compiles C: $CC, cc, gcc or clang, else Zig's if the package ziglang is installed.

    The current folder is not searched: anyone may have put something there.
    """
    named = shlex.split(os.environ.get("CC") or "")
    if named:
        return (os.path.abspath(named[0]) if os.path.dirname(named[0]) else named[0], *named[1:])
    folders = os.environ.get("PATH", os.defpath).split(os.pathsep)
    path = os.pathsep.join(folder for folder in folders if os.path.isabs(folder))
    for name in ("cc", "gcc", "clang"):
        found = shutil.which(name, path=path) if path else None
        if found and os.path.isabs(found):  # Windows looks into the current folder all the same
            return (found,)
    installed = [*site.getsitepackages(), *([site.getusersitepackages()] if site.ENABLE_USER_SITE else [])]
    package = PathFinder.find_spec("ziglang", installed)
    if package and package.origin:
        zig = shutil.which("zig", path=str(Path(package.origin).parent))
        if zig:
            return (zig, "cc")
    raise CompilerError("no C compiler was found (cc, gcc, clang, or the package ziglang).")


def _compile(
    sources: tuple[str, str], command: tuple[str, ...], kept: Cache, name: str, load: Callable[[Path], Build]
) -> Build:
    """Compile beside the target, and keep what works."""
    with kept.workshop() as own:
        unit, model, made = own / "unit.c", own / "model.h", own / f"library{SUFFIX}"
        unit.write_text(sources[0], encoding="utf-8")
        model.write_text(sources[1], encoding="utf-8")
        includes = [f"-I{path}" for path in (SOURCES / "include", SOURCES / "src", own)]
        system = [] if os.name == "nt" else ["-fPIC", "-lm"]
        complaint = ""
        for tuning in ((*GCC, *WIDE) if _is_gcc(command) else CLANG, PLAIN):
            arguments = [*command, *COMMON, *tuning, *includes, "-o", str(made), str(unit), *system]
            returned, printed = _run(arguments, own)
            if returned == 0 and made.exists():
                break
            complaint = complaint or printed.strip()[-500:] or f"it made no library, and ended with {returned}"
        else:
            cure = f" {CURE}" if os.strerror(ENOSPC) in complaint else ""
            raise CompilerError(f"{shlex.join(command)} failed: {complaint}{cure}")
        try:
            loaded = load(made)
        except (OSError, ValueError) as error:
            raise CompilerError(f"{shlex.join(command)} made a library that cannot be used: {error}. {CURE}") from None
        kept.keep(made, name)
        return loaded


def _run(arguments: Sequence[str], folder: Path) -> tuple[int, str]:
    """Run a compiler in a folder; what it returned and printed. If it hangs, it is ended with all it has started."""
    try:
        process = subprocess.Popen(
            arguments,
            cwd=folder,
            env=os.environ | {"TMPDIR": str(folder), "LC_ALL": "C"},
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


def _load(library: Path) -> Build:
    loaded = ctypes.CDLL(str(library))
    table = ctypes.addressof(ctypes.c_char.in_dll(loaded, "rumo_core_tailored"))
    build_name(table)  # raises if it is of another version
    return Build("tailored", table, loaded)


def _load_right_side(library: Path) -> Build:
    loaded = ctypes.CDLL(str(library))
    version = ctypes.c_int.in_dll(loaded, "rumo_right_side_tailored")  # its first member
    if version.value != VERSION:
        raise ValueError("the tailored build belongs to another version")
    return Build("tailored", ctypes.addressof(version), loaded)


@cache
def _is_gcc(command: tuple[str, ...]) -> bool:
    return "Free Software Foundation" in _run([*command, "--version"], SOURCES)[1]


def _program(command: tuple[str, ...]) -> str:
    """A compiler's program: another version is another file."""
    found = shutil.which(command[0]) or command[0]
    with suppress(OSError):
        status = os.stat(found)
        return f"{os.path.realpath(found)} {status.st_size} {status.st_mtime_ns}"
    return found


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
    flags = repr((COMMON, GCC, WIDE, CLANG, PLAIN))
    for text in (*sources, shlex.join(command), _program(command), __version__, _machine(), flags):
        digest.update(text.encode())
    for path in files:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:32]
