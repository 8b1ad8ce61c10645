"""Builds for one problem: made once, kept whole, and the portable core where that is not possible."""

import logging
import os
import shutil
import site
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from problems import pendulum, rod

import rumo
from rumo.cli.progress import progress
from rumo.controllers.engines.described import core_problem
from rumo.kernel import tailored as build_for
from rumo.kernel.cache import SUFFIX, open_cache
from rumo.kernel.tailored import _fingerprint, _sources, compiler
from rumo.status import Status
from rumo.transcription import Transcription

# The function of that name hides the module.
tailored = sys.modules["rumo.kernel.tailored"]

needs_cc = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler (cc) on this machine")
needs_shell = pytest.mark.skipif(os.name != "posix", reason="stands in for the compiler with a script")
X, REFERENCE = [0.3, 0.0], np.full((13, 1), 0.1)


@pytest.fixture(autouse=True)
def forget_failures(monkeypatch):
    monkeypatch.setattr(tailored, "_hopeless", {})
    tailored._report.cache_clear()
    tailored._is_gcc.cache_clear()


@pytest.fixture
def cache(tmp_path, monkeypatch):
    folder = tmp_path / "cache"
    monkeypatch.setenv("RUMO_CACHE", str(folder))
    return folder


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A library of the pendulum, to be copied: what is loaded must not be written to."""
    folder = tmp_path_factory.mktemp("made")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RUMO_CACHE", str(folder))
        assert build_for(describe(pendulum())).name == "tailored"
    (library,) = libraries(folder)
    return library


def describe(problem):
    return core_problem(Transcription(problem))


def libraries(folder):
    return sorted(path for path in folder.iterdir() if path.suffix == SUFFIX)


def first_command(**options):
    controller = rumo.RealTimeIteration(pendulum(), **options)
    return controller.backend, controller.step(X, REFERENCE).u.values


def stand_in(monkeypatch, tmp_path, body):
    """A compiler that is a Python script; `out` is where the library is to go. It counts its runs."""
    script = tmp_path / "compiler.py"
    script.write_text(
        "import sys, time, os, shutil, pathlib\n"
        "if '--version' in sys.argv: sys.exit()\n"
        f"with open({str(tmp_path / 'runs')!r}, 'a') as runs: runs.write('run ')\n"
        f"out = sys.argv[sys.argv.index('-o') + 1]\n{body}\n"
    )
    monkeypatch.setenv("CC", f"{sys.executable} {script}")
    return lambda: (tmp_path / "runs").read_text().split() if (tmp_path / "runs").exists() else []


@needs_cc
def test_compiled_once_and_kept(made, cache, monkeypatch):
    shutil.copy(made, open_cache().folder)
    monkeypatch.setattr(tailored, "_compile", lambda *_: pytest.fail("the cache has it"))
    backend, u = first_command(backend="tailored")
    assert backend == "tailored"
    np.testing.assert_allclose(u, first_command(backend="portable")[1], atol=1e-12)


@needs_cc
def test_compiling_for_the_first_time_is_said(made, cache, monkeypatch, tmp_path, capsys):
    stand_in(monkeypatch, tmp_path, f"shutil.copy({str(made)!r}, out)")
    said = []
    for _ in range(2):
        with progress():
            assert first_command(backend="tailored")[0] == "tailored"
        said.append(capsys.readouterr().err)
    assert "Compiling the core for this problem" in said[0]
    assert not said[1]


@needs_cc
@pytest.mark.parametrize("damage", ["empty", "half", "one bit"])
def test_damaged_library_is_replaced(damage, made, cache, monkeypatch, tmp_path):
    open_cache()
    whole = made.read_bytes()
    spoiled = bytearray(whole)
    spoiled[len(whole) // 2] ^= 1
    (cache / made.name).write_bytes({"empty": b"", "half": whole[: len(whole) // 2], "one bit": bytes(spoiled)}[damage])
    name = made.stem.rpartition("-")[0]
    monkeypatch.setattr(tailored, "_fingerprint", lambda *_: name)
    runs = stand_in(monkeypatch, tmp_path, f"shutil.copy({str(made)!r}, out)")
    assert first_command(backend="tailored")[0] == "tailored"
    assert runs() == ["run"]
    assert (cache / made.name).read_bytes() == whole


@needs_cc
def test_half_a_library_is_never_seen(made, cache, monkeypatch, tmp_path):
    log = tmp_path / "seen"
    body = f"""
whole = open({str(made)!r}, 'rb').read()
with open(out, 'wb') as file:
    file.write(whole[:len(whole) // 2]); file.flush()
    seen = [path.name for path in pathlib.Path({str(cache)!r}).iterdir() if path.suffix == {SUFFIX!r}]
    open({str(log)!r}, 'w').write(' '.join(seen))
    file.write(whole[len(whole) // 2:])
"""
    stand_in(monkeypatch, tmp_path, body)
    assert first_command(backend="tailored")[0] == "tailored"
    assert log.read_text() == ""
    assert [path.suffix for path in cache.iterdir()] == [SUFFIX], "nothing but the library is left"


@needs_cc
def test_three_processes_at_once_compile_once(made, cache, monkeypatch, tmp_path):
    """The compiler ends only when all three want the same library."""
    body = f"""
while len(list(pathlib.Path({str(tmp_path)!r}).glob("wanted-*"))) < 3: time.sleep(0.01)
time.sleep(0.2)
shutil.copy({str(made)!r}, out)
"""
    runs = stand_in(monkeypatch, tmp_path, body)
    program = (
        f"import os, pathlib, rumo; from problems import pendulum; problem = pendulum();"
        f"pathlib.Path({str(tmp_path)!r}, f'wanted-{{os.getpid()}}').touch();"
        "c = rumo.RealTimeIteration(problem, backend='tailored');"
        "print(c.backend, c.step([0.3, 0.0], {'angle': 0.1}).command['torque'])"
    )
    environment = os.environ | {"PYTHONPATH": os.path.dirname(sys.modules["problems"].__file__)}
    all_three = [
        subprocess.Popen([sys.executable, "-c", program], env=environment, stdout=subprocess.PIPE, text=True)
        for _ in range(3)
    ]
    answers = [process.communicate(timeout=300)[0].split() for process in all_three]
    assert answers[0][0] == "tailored"
    assert answers == [answers[0]] * 3
    assert len(runs()) == 1
    (kept,) = libraries(cache)
    assert list(cache.iterdir()) == [kept], "nothing but the library is left"


@needs_cc
def test_a_process_that_hangs_while_it_builds_is_not_waited_for_for_ever(made, cache, monkeypatch, tmp_path):
    runs = stand_in(monkeypatch, tmp_path, f"shutil.copy({str(made)!r}, out)")
    monkeypatch.setattr(tailored, "_fingerprint", lambda *_: "name")
    monkeypatch.setattr(tailored, "PATIENCE", 0.1)
    with open_cache().alone("name", 1.0):
        assert first_command(backend="tailored")[0] == "tailored"
    assert runs() == ["run"]


FAILURES = {
    "fails": ("print('sorry', file=sys.stderr); sys.exit(3)", "sorry"),
    "says nothing": ("sys.exit(1)", "ended with 1"),
    "makes nothing": ("", "made no library"),
    "makes garbage": ("open(out, 'wb').write(bytes(5000))", "cannot be used"),
    "makes another library": ("os.system('cc -shared -x c /dev/null -o ' + out)", "cannot be used"),
}


@needs_cc
@needs_shell
@pytest.mark.parametrize("failure", FAILURES)
def test_broken_compiler_means_portable(failure, cache, monkeypatch, tmp_path, caplog):
    body, reason = FAILURES[failure]
    runs = stand_in(monkeypatch, tmp_path, body)
    with caplog.at_level(logging.WARNING, "rumo"):
        backend, u = first_command(backend="tailored")
        assert backend == "portable"
        np.testing.assert_array_equal(u, first_command(backend="portable")[1])
        attempts = len(runs())
        assert first_command(backend="tailored")[0] == "portable"
    assert len(runs()) == attempts, "it is not tried again for the same problem"
    (record,) = caplog.records
    assert "portable build" in record.getMessage()
    assert reason in record.getMessage()
    assert list(cache.iterdir()) == [], "nothing is left"


@needs_shell
def test_hanging_compiler_is_ended_with_its_children(cache, monkeypatch, tmp_path, caplog):
    monkeypatch.setattr(tailored, "PATIENCE", 2.0)
    child = tmp_path / "child"
    stand_in(monkeypatch, tmp_path, f"os.system('echo $$ > {child}; exec sleep 600')")
    assert first_command(backend="tailored")[0] == "portable"
    (record,) = caplog.records
    assert "within 2 s" in record.getMessage()
    deadline = time.monotonic() + 20.0
    while time.monotonic() < deadline:
        try:
            os.kill(int(child.read_text()), 0)
        except ProcessLookupError:
            return
        if (
            "Z"
            in subprocess.run(
                ["ps", "-o", "stat=", "-p", child.read_text().strip()], capture_output=True, text=True
            ).stdout
        ):
            return
        time.sleep(0.05)
    pytest.fail("the compiler's child is still there")


@pytest.mark.parametrize(("variable", "value"), [("CC", "no-such-compiler"), ("CC", "'"), ("RUMO_CACHE", __file__)])
def test_wrong_settings_mean_portable(variable, value, cache, monkeypatch, caplog):
    monkeypatch.setenv(variable, value)
    assert first_command(backend="tailored")[0] == "portable"
    assert len(caplog.records) == 1


@needs_cc
def test_plain_flags_where_others_are_not_known(made, cache, monkeypatch, tmp_path):
    body = f"sys.exit('what is -march?') if '-march=native' in sys.argv else shutil.copy({str(made)!r}, out)"
    runs = stand_in(monkeypatch, tmp_path, body)
    assert first_command(backend="tailored")[0] == "tailored"
    assert len(runs()) == 2


@needs_cc
def test_another_stage_solver(cache, monkeypatch):
    """All that a step needs of a solver passes through its seam: this one leaves the inputs as they are."""
    staying = str(Path(__file__).with_name("staying.c"))
    monkeypatch.setattr("rumo.controllers.engines.core.tailored", lambda description: build_for(description, staying))
    problem = pendulum(bounds={"torque": (-2.0, 2.0), "angle": rumo.Bounds(-1.0, 0.31, rumo.Penalty(1.0))})
    controller = rumo.RealTimeIteration(problem, backend="tailored")
    assert controller.backend == "tailored"
    controller.reset(applied=[1.0])
    for x, status in ((X, Status.OPTIMAL), ([0.3, 0.5], Status.SOFT_VIOLATED)):
        plan = controller.step(x, REFERENCE)
        assert plan.status is status
        np.testing.assert_array_equal(plan.u.values, np.ones((12, 1)))
        for before, after in zip(plan.x.values[:-1], plan.x.values[1:], strict=True):
            np.testing.assert_allclose(controller.transcription.advance(before, [1.0])[0], after, atol=1e-12)


@needs_cc
def test_key_depends_on_all_that_matters(monkeypatch):
    def key(problem, command=("cc",)):
        return _fingerprint(_sources(describe(problem)), command)

    usual = key(pendulum())
    assert usual == key(pendulum())
    # Weights and limits are data, not code.
    assert usual == key(pendulum(bounds={"torque": (-1.0, 1.0)}))
    assert usual != key(pendulum(horizon=11))
    assert usual != key(pendulum(delay=2))
    assert usual != key(pendulum(sampling_time=0.1))
    assert usual != key(pendulum(constraints={"swing": rumo.Constraint(lambda x, u, p: x.angle**2 - 1.0)}))
    assert usual != key(pendulum(), ("cc", "-O1"))
    monkeypatch.setattr(tailored, "COMMON", (*tailored.COMMON, "-g"))
    assert usual != key(pendulum())


@pytest.mark.slow
def test_zig_as_the_compiler(cache, monkeypatch):
    pytest.importorskip("ziglang", reason="the package ziglang is not installed")
    monkeypatch.setenv("CC", f"{sys.executable} -m ziglang cc")
    backend, u = first_command(backend="tailored")
    assert backend == "tailored"
    np.testing.assert_allclose(u, first_command(backend="portable")[1], atol=1e-12)


def test_search_for_a_compiler(monkeypatch, tmp_path):
    def offer(name):
        program = tmp_path / name
        program.parent.mkdir(exist_ok=True)
        program.touch(mode=0o755)
        return str(program)

    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(site, "getsitepackages", lambda: [str(tmp_path)])
    monkeypatch.setattr(site, "ENABLE_USER_SITE", False)
    with pytest.raises(tailored.CompilerError, match="no C compiler was found"):
        compiler()
    zig = offer("ziglang/zig")
    (tmp_path / "ziglang" / "__init__.py").touch()
    assert compiler() == (zig, "cc")
    clang = offer("clang")
    assert compiler() == (clang,)
    monkeypatch.setenv("CC", "ccache some-cc -O1")
    assert compiler() == ("ccache", "some-cc", "-O1")


def test_without_a_compiler_the_installed_core_works(tmp_path):
    program = """
import logging, site
site.getsitepackages, site.ENABLE_USER_SITE = list, False
records = []
class Keep(logging.Handler):
    def emit(self, record): records.append(record.getMessage())
logging.getLogger("rumo").addHandler(Keep())
import rumo
from problems import pendulum
for _ in range(2):
    controller = rumo.RealTimeIteration(pendulum())
    plan = controller.step([0.3, 0.0], {"angle": 0.1})
    print(controller.backend, plan.status.name, float(plan.command["torque"]).hex(), len(records), records[0])
"""
    environment = {name: value for name, value in os.environ.items() if name not in ("CC", "RUMO_BACKEND")}
    environment |= {"PATH": "", "RUMO_CACHE": str(tmp_path)}
    environment |= {"PYTHONPATH": os.path.dirname(sys.modules["problems"].__file__)}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    expected = first_command(backend="portable")[1][1, 0]
    for line in done.stdout.splitlines():
        backend, status, command, records, reason = line.split(maxsplit=4)
        assert (backend, status, records) == ("portable", "OPTIMAL", "1")
        assert float.fromhex(command) == expected
        assert "no C compiler" in reason


def test_very_wide_models_are_not_compiled(cache, caplog):
    with caplog.at_level(logging.INFO, "rumo"):
        controller = rumo.RealTimeIteration(rod(320), backend="tailored")
    assert controller.backend == "portable"
    assert "compiling so wide a model takes long" in caplog.text
    assert not cache.exists()
