"""Compiles C as CMakeLists.txt does, with every warning an error."""

import shutil
import subprocess
from pathlib import Path

CORE = Path(__file__).parents[2] / "core"
STRICT = ("-std=c11", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror")
ARITHMETIC = ("-ffp-contract=fast", "-fno-math-errno", "-fno-trapping-math")
SANITIZED = ("-O1", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
INCLUDES = tuple(f"-I{CORE / part}" for part in ("include", "src", "tests"))
NO_COMPILER = "no C compiler (cc) on this machine"


def compiler():
    """The C compiler's command, or None."""
    found = shutil.which("cc")
    return None if found is None else (found,)


def compile_c(command, source, output, *flags):
    """Compile one source file; the compiler's complaint is the test's failure."""
    arguments = [*command, *STRICT, *ARITHMETIC, *INCLUDES, *flags, str(source), "-o", str(output)]
    done = subprocess.run(
        [*arguments, *([] if "-c" in flags else ["-lm"])], capture_output=True, text=True, timeout=300, check=False
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
