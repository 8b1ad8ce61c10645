"""The C core's own tests in C, under sanitizers; and that no step allocates."""

import subprocess
import sys

import pytest
from compiling import CORE, NO_COMPILER, SANITIZED, compile_c, compiler, run_c

pytestmark = pytest.mark.skipif(compiler() is None, reason=NO_COMPILER)

FILES = sorted(path.relative_to(CORE) for part in ("include", "src") for path in (CORE / part).rglob("*.[ch]"))

on_linux = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="about ELF files and the GNU C library's allocator"
)
PROGRAMS = sorted(path.stem for path in (CORE / "tests").glob("test_*.c"))
OWN_ALLOCATOR = "test_allocation"
LONG_SOAK, SHORT_SOAK = 300_000, 60_000
ALLOWED = """
    memcpy memset memmove memcmp clock_gettime frexp ldexp
    sqrt fmod asin acos atan atan2 sinh cosh tanh asinh acosh atanh exp
    expm1 log log1p pow hypot erf floor ceil fmin fmax __stack_chk_fail _GLOBAL_OFFSET_TABLE_
"""


@pytest.fixture(scope="module")
def core_object(tmp_path_factory):
    output = tmp_path_factory.mktemp("core") / "core.o"
    return compile_c(compiler(), CORE / "src" / "core.c", output, "-O3", "-Wshadow", "-c")


@pytest.mark.parametrize("path", FILES, ids=str)
def test_a_file_opens_by_itself(path):
    includes = [f"-I{CORE / part}" for part in ("include", "src")]
    command = [*compiler(), "-std=c11", "-fsyntax-only", "-Wall", "-Wextra", "-Wno-unused-function", *includes]
    done = subprocess.run([*command, str(CORE / path)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("path", FILES, ids=str)
def test_a_file_can_be_read_in_one_go(path):
    assert len((CORE / path).read_text(encoding="utf-8").splitlines()) <= 350


@pytest.mark.parametrize("program", [name for name in PROGRAMS if name != OWN_ALLOCATOR])
def test_in_c_under_sanitizers(program, headers, tmp_path):
    source = CORE / "tests" / f"{program}.c"
    run_c(compile_c(compiler(), source, tmp_path / program, *SANITIZED, "-O0", f"-I{headers}"))


@on_linux
def test_no_step_allocates(headers, tmp_path):
    source = CORE / "tests" / f"{OWN_ALLOCATOR}.c"
    run_c(compile_c(compiler(), source, tmp_path / OWN_ALLOCATOR, "-O2", f"-I{headers}"))


def symbols(core_object, *options):
    """(kind, name) of each symbol; kinds as nm gives them."""
    listed = subprocess.run(["nm", *options, str(core_object)], capture_output=True, text=True, check=True).stdout
    return [tuple(line.split()[-2:]) for line in listed.splitlines()]


@on_linux
def test_calls_nothing_but_arithmetic_and_the_clock(core_object):
    needed = {name.split("@")[0] for _, name in symbols(core_object, "-u")}
    assert needed <= set(ALLOWED.split())


@on_linux
def test_has_no_variables(core_object):
    data = [name for kind, name in symbols(core_object) if kind in "bBsSgGCdD"]
    assert data == ["rumo_core"], "the table of functions is constant, but a loader fills in its addresses"


@pytest.mark.parametrize("program", ["test_steps", "test_update", "soak"])
def test_tailored_under_sanitizers(program, tailored_headers, tmp_path):
    flags = ("-include", str(tailored_headers / "tailored.h"), f"-I{tailored_headers}")
    source = CORE / "tests" / f"{program}.c"
    run_c(compile_c(compiler(), source, tmp_path / program, *SANITIZED, *flags), 5000)


@pytest.mark.parametrize(
    ("flags", "steps"), [(("-O2",), SHORT_SOAK), (SANITIZED, SHORT_SOAK // 6)], ids=["fast", "sanitized"]
)
def test_random_steps(flags, steps, headers, tmp_path):
    run_c(compile_c(compiler(), CORE / "tests" / "soak.c", tmp_path / "soak", *flags, f"-I{headers}"), steps)


@pytest.mark.slow
@pytest.mark.parametrize(("flags", "steps"), [(("-O2",), 1_000_000), (SANITIZED, LONG_SOAK)], ids=["fast", "sanitized"])
def test_many_random_steps(flags, steps, headers, tmp_path):
    print(run_c(compile_c(compiler(), CORE / "tests" / "soak.c", tmp_path / "soak", *flags, f"-I{headers}"), steps, 2))
