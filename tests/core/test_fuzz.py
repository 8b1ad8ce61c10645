"""The corpus of the fuzzer, run again under the sanitizers; `fuzz.py` looks for more."""

import subprocess

import pytest
from compiling import CORE, NO_COMPILER, SANITIZERS, compile_test, compiler
from fuzz import FUZZ, TARGETS, corpus

pytestmark = pytest.mark.skipif(compiler() is None, reason=NO_COMPILER)


@pytest.mark.parametrize("target", TARGETS)
def test_corpus_under_sanitizers(target, core_of, headers, tmp_path):
    program = compile_test(
        compiler(),
        "../fuzz/replay",
        core_of("sanitized"),
        tmp_path / target,
        *SANITIZERS,
        f"-I{headers}",
        f"-I{FUZZ}",
        str(FUZZ / f"{target}.c"),
    )
    inputs = corpus(target)
    done = subprocess.run([program, *inputs], capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    assert done.stdout == f"{2 * len(inputs)} passed, 0 failed\n"


def test_the_corpus_stays_small():
    assert set(TARGETS) == {path.stem for path in (CORE / "fuzz").glob("*.c")} - {"replay"}
    for target in TARGETS:
        assert sum(path.stat().st_size for path in corpus(target)) < 10_000
