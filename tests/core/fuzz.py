"""Fuzzes the core with libFuzzer (clang): `python tests/core/fuzz.py program --seconds 1800`.

What it finds is left in the current folder; `--merge` adds inputs to the corpus that reach something new.
"""

import argparse
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from compiling import ARITHMETIC, CORE, SANITIZERS

FUZZ = CORE / "fuzz"
TARGETS = sorted(path.parent.name for path in FUZZ.glob("corpus/*/0"))
LENGTH = 300
"""Of an input [bytes]: enough for all edits of a description."""


def corpus(target):
    """The inputs of a target that are kept."""
    return sorted((FUZZ / "corpus" / target).iterdir())


def write_headers(folder):
    """fixtures.h, with a sample of each problem, and patterns.h."""
    from fixtures import fixture_header, fixtures, pattern_header  # the tests have made them already

    (folder / "fixtures.h").write_text(fixture_header(fixtures(), samples=1), encoding="utf-8")
    (folder / "patterns.h").write_text(pattern_header(), encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("target", choices=TARGETS)
    parser.add_argument("--seconds", type=int, default=600)
    parser.add_argument("--merge", action="store_true", help="add to the corpus what reaches something new")
    chosen = parser.parse_args()
    clang = shutil.which("clang") or sys.exit("Fuzzing needs clang with its libFuzzer.")
    kept = FUZZ / "corpus" / chosen.target
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        write_headers(folder)
        program, found = folder / chosen.target, folder / "found"
        found.mkdir()
        includes = [f"-I{CORE / part}" for part in ("include", "src", "tests", "fuzz")]
        flags = ["-std=c11", "-g", "-O1", "-fno-inline", *ARITHMETIC, *SANITIZERS, "-fsanitize=fuzzer"]
        sources = [FUZZ / f"{chosen.target}.c", CORE / "src" / "core.c"]
        subprocess.run([clang, *flags, *includes, f"-I{folder}", "-o", program, *sources, "-lm"], check=True)
        limits = [f"-max_len={LENGTH}", "-len_control=0", f"-max_total_time={chosen.seconds}"]
        done = subprocess.run([program, *limits, found, kept], check=False)
        if chosen.merge and done.returncode == 0:
            subprocess.run([program, "-merge=1", kept, found], check=True)
    sys.exit(done.returncode)


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))
    main()
