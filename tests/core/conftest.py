"""The problems as C headers, and the core in several builds: made once in a test run."""

import fcntl
import tempfile
from pathlib import Path

import pytest
from compiling import SANITIZERS, compile_core, compiler, tailored_flags
from fixtures import fixture_header, fixtures, pattern_header, system_header, tailored_model


def made_once(shared_folder, name, make):
    """A folder that the first worker fills, and all others share."""
    folder = shared_folder / name
    with folder.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not folder.exists():
            with tempfile.TemporaryDirectory(dir=folder.parent) as making:
                whole = Path(making, name)
                whole.mkdir()
                make(whole)
                whole.rename(folder)
    return folder


def write_fixtures(folder, chosen):
    (folder / "fixtures.h").write_text(fixture_header(chosen, samples=25), encoding="utf-8")


@pytest.fixture(scope="session")
def headers(shared_folder):
    """A folder with fixtures.h, patterns.h and systems.h."""

    def make(folder):
        write_fixtures(folder, fixtures())
        (folder / "patterns.h").write_text(pattern_header(), encoding="utf-8")
        (folder / "systems.h").write_text(system_header(), encoding="utf-8")

    return made_once(shared_folder, "headers", make)


@pytest.fixture(scope="session")
def tailored_headers(shared_folder):
    """A folder with fixtures.h of the paper's car alone, and what a build tailored to it needs: tailored.h, model.h."""

    def make(folder):
        chosen = {"car_soft_2": fixtures()["car_soft_2"]}
        write_fixtures(folder, chosen)
        defines, model = tailored_model(chosen["car_soft_2"])
        (folder / "tailored.h").write_text(defines, encoding="utf-8")
        (folder / "model.h").write_text(model, encoding="utf-8")

    return made_once(shared_folder, "tailored", make)


@pytest.fixture(scope="session")
def core_of(shared_folder, tailored_headers):
    """The core as an object file: fast, sanitized, that with hardly any room for members, or tailored and sanitized."""
    sanitized = ("-O1", "-fno-inline", *SANITIZERS)  # inlining takes a while, and gains nothing beside the checks
    builds = {
        "fast": ("-O2", "-Wshadow"),
        "sanitized": sanitized,
        "roomless": (*sanitized, "-DRUMO_KEPT_MEMBERS=2"),
        "tailored": (*sanitized, *tailored_flags(tailored_headers)),
    }

    def make(name):
        folder = made_once(
            shared_folder, f"core-{name}", lambda folder: compile_core(compiler(), folder / "core.o", *builds[name])
        )
        return folder / "core.o"

    return make
