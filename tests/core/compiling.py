"""Compiles C as CMakeLists.txt does, with every warning an error."""

import shutil
import subprocess
from pathlib import Path

CORE = Path(__file__).parents[2] / "core"
STRICT = ("-std=c11", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror")
ARITHMETIC = ("-ffp-contract=fast", "-fno-math-errno", "-fno-trapping-math")
SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")
INCLUDES = tuple(f"-I{CORE / part}" for part in ("include", "src", "tests"))
NO_COMPILER = "no C compiler (cc) on this machine"


def compiler():
    """The C compiler's command, or None."""
    found = shutil.which("cc")
    return None if found is None else (found,)


def tailored_flags(folder):
    """What a tailored build is compiled with."""
    return "-include", str(folder / "tailored.h"), f"-I{folder}"


def compile_core(command, output, *flags):
    """Compile the core; the compiler's complaint is the test's failure."""
    return _compile(command, output, *flags, "-c", str(CORE / "src" / "core.c"))


def compile_test(command, program, core, output, *flags):
    """Compile a test in C, and link it with a core; of parts that it includes it may leave functions unused."""
    source = CORE / "tests" / f"{program}.c"
    return _compile(command, output, "-Wno-unused-function", *flags, str(source), str(core), "-lm")


def _compile(command, output, *arguments):
    done = subprocess.run(
        [*command, *STRICT, *ARITHMETIC, *INCLUDES, "-o", str(output), *arguments],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return output


def run_c(*command, timeout=600):
    """Run a C test; returns what it printed."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=timeout, check=False)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    passed, _, failed, _ = done.stdout.splitlines()[-1].split()
    assert int(passed) > 0
    assert int(failed) == 0
    return done.stdout
