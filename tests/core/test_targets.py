"""The core for other systems and processors, by Zig's C compiler; and its tests run on an emulated ARM processor."""

import shutil
import sys

import pytest
from compiling import compile_core, compile_test, run_c, tailored_flags

pytest.importorskip("ziglang", reason="the package ziglang is not installed")
pytestmark = pytest.mark.slow

TARGETS = (
    "aarch64-linux-gnu",
    "aarch64-macos",
    "aarch64-windows-gnu",
    "riscv64-linux-musl",
    "x86_64-linux-gnu",
    "x86_64-linux-musl",
    "x86_64-macos",
    "x86_64-windows-gnu",
)
EMULATED = "aarch64-linux-musl"
EMULATOR = shutil.which("qemu-aarch64") or shutil.which("qemu-aarch64-static")
PROGRAMS = ("test_curve", "test_elementary", "test_elimination", "test_factorization", "test_qp", "test_steps")
needs_emulator = pytest.mark.skipif(EMULATOR is None, reason="no qemu-aarch64 on this machine (package qemu-user)")


def zig(target):
    return sys.executable, "-m", "ziglang", "cc", "-target", target


@pytest.mark.parametrize("target", TARGETS)
def test_portable_core_compiles_without_warnings(target, tmp_path):
    compile_core(zig(target), tmp_path / "core.o", "-O2")


@pytest.mark.parametrize("target", ["x86_64-windows-gnu", "aarch64-macos"])
def test_tailored_core_compiles_without_warnings(target, tailored_headers, tmp_path):
    compile_core(zig(target), tmp_path / "core.o", "-O2", *tailored_flags(tailored_headers))


def run_emulated(program, headers, tmp_path, *arguments):
    core = compile_core(zig(EMULATED), tmp_path / "core.o", "-O2")
    made = compile_test(zig(EMULATED), program, core, tmp_path / program, "-static", "-O2", f"-I{headers}")
    run_c(EMULATOR, made, *arguments)


@needs_emulator
@pytest.mark.parametrize("program", PROGRAMS)
def test_in_c_on_arm(program, headers, tmp_path):
    run_emulated(program, headers, tmp_path)


@needs_emulator
def test_random_steps_on_arm(headers, tmp_path):
    run_emulated("soak", headers, tmp_path, 20_000)
