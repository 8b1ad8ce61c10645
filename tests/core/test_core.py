"""The C core's own tests in C, under sanitizers; and that no step allocates."""

import subprocess
import sys

import pytest
from compiling import CORE, NO_COMPILER, SANITIZERS, compile_test, compiler, run_c, tailored_flags

pytestmark = pytest.mark.skipif(compiler() is None, reason=NO_COMPILER)

FILES = sorted(path.relative_to(CORE) for part in ("include", "src") for path in (CORE / part).rglob("*.[ch]"))

on_linux = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="about ELF files and the GNU C library's allocator"
)
PROGRAMS = sorted(path.stem for path in (CORE / "tests").glob("test_*.c"))
OWN_ALLOCATOR = "test_allocation"
ALLOWED = """
    memcpy memset memmove memcmp clock_gettime frexp ldexp
    sqrt fmod sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh exp
    expm1 log log1p pow hypot erf floor ceil fmin fmax __stack_chk_fail _GLOBAL_OFFSET_TABLE_
"""


@pytest.mark.parametrize("path", FILES, ids=str)
def test_a_file_opens_by_itself(path):
    includes = [f"-I{CORE / part}" for part in ("include", "src")]
    command = [*compiler(), "-std=c11", "-fsyntax-only", "-Wall", "-Wextra", "-Wno-unused-function", *includes]
    done = subprocess.run([*command, str(CORE / path)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("path", FILES, ids=str)
def test_a_file_can_be_read_in_one_go(path):
    assert len((CORE / path).read_text(encoding="utf-8").splitlines()) <= 350


@pytest.mark.slow
@pytest.mark.parametrize("program", [name for name in PROGRAMS if name != OWN_ALLOCATOR])
def test_in_c_under_sanitizers(program, core_of, headers, tmp_path):
    run_c(compile_test(compiler(), program, core_of("sanitized"), tmp_path / program, *SANITIZERS, f"-I{headers}"))


@pytest.mark.slow
def test_steps_with_hardly_any_room_for_members(core_of, headers, tmp_path):
    run_c(compile_test(compiler(), "test_steps", core_of("roomless"), tmp_path / "test", *SANITIZERS, f"-I{headers}"))


@on_linux
def test_no_step_allocates(core_of, headers, tmp_path):
    run_c(compile_test(compiler(), OWN_ALLOCATOR, core_of("fast"), tmp_path / OWN_ALLOCATOR, f"-I{headers}"))


def symbols(core_object, *options):
    """(kind, name) of each symbol; kinds as nm gives them."""
    listed = subprocess.run(["nm", *options, str(core_object)], capture_output=True, text=True, check=True).stdout
    return [tuple(line.split()[-2:]) for line in listed.splitlines()]


@on_linux
def test_calls_nothing_but_arithmetic_and_the_clock(core_of):
    needed = {name.split("@")[0] for _, name in symbols(core_of("fast"), "-u")}
    assert needed <= set(ALLOWED.split())


@on_linux
def test_has_no_variables(core_of):
    data = {name for kind, name in symbols(core_of("fast")) if kind in "bBsSgGCdD"}
    tables = {"rumo_core", "matrix_space", "dense_space", "dense_solver", "riccati_space", "riccati_solver"}
    assert data == tables, "tables of functions are constant, but a loader fills in their addresses"


@pytest.mark.slow
@pytest.mark.parametrize(("program", "steps"), [("test_steps", ""), ("test_update", ""), ("soak", 5_000)])
def test_tailored_under_sanitizers(program, steps, core_of, tailored_headers, tmp_path):
    flags = *SANITIZERS, *tailored_flags(tailored_headers)
    run_c(compile_test(compiler(), program, core_of("tailored"), tmp_path / program, *flags), steps)


@pytest.mark.parametrize(
    ("build", "steps"),
    [
        ("fast", 6_000),
        ("sanitized", 500),
        *(pytest.param(*more, marks=pytest.mark.slow) for more in (("fast", 30_000), ("sanitized", 5_000))),
    ],
)
def test_random_steps(build, steps, core_of, headers, tmp_path):
    run_c(soak(build, core_of, headers, tmp_path), steps)


@pytest.mark.slow
@pytest.mark.parametrize(("build", "steps"), [("fast", 1_000_000), ("sanitized", 300_000), ("roomless", 100_000)])
def test_many_random_steps(build, steps, core_of, headers, tmp_path):
    print(run_c(soak(build, core_of, headers, tmp_path), steps, 2))


def soak(build, core_of, headers, tmp_path):
    flags = () if build == "fast" else SANITIZERS
    return compile_test(compiler(), "soak", core_of(build), tmp_path / "soak", "-O1", *flags, f"-I{headers}")
