"""The folder of tailored builds: nobody else's library is loaded, and without a folder there is the portable build."""

import logging
import os
import shutil
import stat
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest
from problems import pendulum

import rumo
from rumo.kernel.cache import ABANDONED, FORGOTTEN, SUFFIX, CacheError, open_cache

tailored = sys.modules["rumo.kernel.tailored"]

posix = pytest.mark.skipif(os.name != "posix", reason="Windows has neither modes nor this kind of owner")
root_only = pytest.mark.skipif(
    os.name != "posix" or os.geteuid() != 0, reason="only root may act as, or give files to, another user"
)
STRANGER = 54321
"""A user's number that this machine has no entry for, as that of a service has none."""


@pytest.fixture(autouse=True)
def forget(monkeypatch):
    monkeypatch.setenv("CC", "cc")  # whether there is one does not matter here
    monkeypatch.setattr(tailored, "_hopeless", {})
    tailored._report.cache_clear()


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("RUMO_CACHE", str(tmp_path / "cache"))
    return open_cache().folder


def put(folder, name, text="a library"):
    """A library as `keep` leaves it."""
    with open_cache().workshop() as own:
        made = own / "made"
        made.write_text(text)
        before = set(folder.glob(f"*{SUFFIX}"))
        open_cache().keep(made, name)
    (new,) = set(folder.glob(f"*{SUFFIX}")) - before
    return new


def make_controllers(caplog, count=2):
    with caplog.at_level(logging.WARNING, "rumo"):
        backends = {rumo.RealTimeIteration(pendulum(), backend="tailored").backend for _ in range(count)}
    return backends, [record.getMessage() for record in caplog.records]


def test_the_folder_is_the_users_own_unless_named(folder, monkeypatch, tmp_path):
    assert folder == (tmp_path / "cache").resolve()
    monkeypatch.delenv("RUMO_CACHE")
    monkeypatch.setattr("rumo.kernel.cache.user_cache_path", lambda name: tmp_path / "home" / name)
    own = open_cache().folder
    assert own == (tmp_path / "home" / "rumo").resolve()
    assert own.is_dir()


@posix
def test_it_is_made_for_its_user_alone(folder):
    before = os.umask(0)
    try:
        assert folder.stat().st_mode & 0o777 == 0o700
        assert put(folder, "name").stat().st_mode & 0o022 == 0
    finally:
        os.umask(before)


def no_home(name):
    raise RuntimeError("could not determine the home directory for '~/.cache'")


@pytest.mark.parametrize(
    "found", [no_home, lambda name: Path("~/.cache") / name], ids=["none", "by the current folder"]
)
def test_without_a_home_there_is_the_portable_build(found, monkeypatch, caplog, tmp_path):
    monkeypatch.delenv("RUMO_CACHE", raising=False)
    monkeypatch.setattr("rumo.kernel.cache.user_cache_path", found)
    monkeypatch.chdir(tmp_path)
    backends, (warning,) = make_controllers(caplog)
    assert backends == {"portable"}
    assert "RUMO_CACHE" in warning
    assert not list(tmp_path.iterdir())


AS_A_SERVICE = """
import os, sys, logging
import rumo
from problems import pendulum
import platformdirs.unix
class Say(logging.Handler):
    def emit(self, record): print(record.getMessage(), end=" ")
logging.getLogger("rumo").addHandler(Say())
os.setgroups([]); os.setgid(54321); os.setuid(54321)
for home in (None, "/", "/root", "/nonexistent"):
    if home: os.environ["HOME"] = home
    sys.modules["rumo.kernel.tailored"]._report.cache_clear()
    for _ in range(2):
        controller = rumo.RealTimeIteration(pendulum())
        print(controller.backend, controller.step([0.3, 0.0], {"angle": 0.1}).status.name, end=" ")
    print()
"""


@root_only
@pytest.mark.skipif(
    not all(
        os.stat(place).st_mode & stat.S_IXOTH
        for place in (*Path(rumo.__file__).parents, *tailored.SOURCES.parents, *Path(sys.prefix).parents)
    ),
    reason="no other user can read the package where it is installed",
)
def test_a_service_without_a_home_has_its_default_controller():
    environment = {k: v for k, v in os.environ.items() if k not in ("HOME", "RUMO_CACHE", "RUMO_BACKEND")}
    environment |= {"PYTHONPATH": os.path.dirname(sys.modules["problems"].__file__)}
    done = subprocess.run(
        [sys.executable, "-c", AS_A_SERVICE], env=environment, cwd="/", capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert len(lines) == 4
    for line in lines:
        assert line.endswith("portable OPTIMAL portable OPTIMAL ")
        assert line.count("The portable build") == line.count("RUMO_CACHE names") == 1


def nothing_written(*_, **__):
    raise OSError(28, "No space left on device")


def test_a_full_disk_means_the_portable_build(folder, monkeypatch, caplog):
    monkeypatch.setattr(Path, "write_text", nothing_written)
    backends, (warning,) = make_controllers(caplog)
    assert backends == {"portable"}
    assert "No space left" in warning
    assert "RUMO_CACHE" in warning
    assert not list(folder.iterdir())


def test_a_read_only_disk_means_the_portable_build(folder, monkeypatch, caplog):
    def refuse(*_, **__):
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(Path, "mkdir", refuse)
    backends, (warning,) = make_controllers(caplog)
    assert backends == {"portable"}
    assert "Read-only" in warning
    assert "RUMO_CACHE" in warning


@posix
@pytest.mark.parametrize("mode", [0o777, 0o775, 0o1777])
def test_a_folder_that_others_may_write_to_is_refused(mode, folder, caplog):
    folder.chmod(mode)
    with pytest.raises(CacheError, match=r"others than this user.*chmod go-w"):
        open_cache()
    backends, warnings = make_controllers(caplog)
    assert backends == {"portable"}
    assert len(warnings) == 1


@posix
def test_a_parent_that_others_may_write_to_needs_the_sticky_bit(folder, monkeypatch):
    within = folder / "within"
    monkeypatch.setenv("RUMO_CACHE", str(within))
    folder.chmod(0o777)
    with pytest.raises(CacheError, match=str(folder)):
        open_cache()
    assert not within.exists()
    folder.chmod(0o1777)
    assert open_cache().folder == within


@posix
def test_a_link_counts_as_what_it_leads_to(folder, monkeypatch, tmp_path):
    link = tmp_path / "link"
    link.symlink_to(folder)
    monkeypatch.setenv("RUMO_CACHE", str(link))
    assert open_cache().folder == folder
    folder.chmod(0o777)
    with pytest.raises(CacheError):
        open_cache()


@root_only
def test_another_users_folder_is_refused(folder):
    os.chown(folder, STRANGER, STRANGER)
    with pytest.raises(CacheError, match=f"belongs to user {STRANGER}"):
        open_cache()


@root_only
def test_another_users_library_is_not_loaded(folder):
    library = put(folder, "name")
    os.chown(library, STRANGER, STRANGER)
    assert list(open_cache().find("name")) == []
    assert not library.exists()


@posix
@pytest.mark.parametrize("mode", [0o666, 0o664])
def test_a_library_that_others_may_write_to_is_not_loaded(mode, folder):
    library = put(folder, "name")
    library.chmod(mode)
    assert list(open_cache().find("name")) == []


@posix
def test_a_link_is_no_library(folder, tmp_path):
    library = put(folder, "name")
    moved = tmp_path / "elsewhere"
    library.rename(moved)
    library.symlink_to(moved)
    assert list(open_cache().find("name")) == []
    assert moved.exists()


def test_a_library_must_be_what_was_kept(folder):
    library = put(folder, "name")
    assert list(open_cache().find("name")) == [library]
    assert list(open_cache().find("other")) == []
    library.write_text("another library")
    assert list(open_cache().find("name")) == []


def test_those_not_used_for_longest_make_room(folder, monkeypatch):
    monkeypatch.setenv("RUMO_CACHE_SIZE", "0.0025")
    kept = [put(folder, name, name * 1000) for name in "ab"]
    for age, library in zip((200.0, 100.0), kept, strict=True):
        os.utime(library, (time.time() - age,) * 2)
    assert list(open_cache().find("a")) == [kept[0]]  # a use
    newest = put(folder, "c", "c" * 1000)
    assert set(folder.iterdir()) == {kept[0], newest}


@pytest.mark.parametrize("size", ["much", "-1", "nan"])
def test_a_wrong_size_is_named(size, folder, monkeypatch):
    monkeypatch.setenv("RUMO_CACHE_SIZE", size)
    with pytest.raises(CacheError, match=f"RUMO_CACHE_SIZE: got '{size}', expected megabytes"):
        open_cache()


def ended_process():
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


def test_what_killed_processes_left_is_removed(folder):
    """By age, where no process of that number runs, and in the end wherever one does."""
    ended, now = ended_process(), time.time()
    cases = {
        f"build-{ended}-old": (ABANDONED + 1.0, False),
        f"build-{ended}-new": (0.0, True),
        f"build-{os.getpid()}-old": (ABANDONED + 1.0, os.name == "posix"),
        f"build-{os.getpid()}-forgotten": (FORGOTTEN + 1.0, False),
        "build-unnumbered": (ABANDONED + 1.0, False),
    }
    for name, (age, _) in cases.items():
        (folder / name).mkdir()
        (folder / name / "unit.c").write_text("half a f")
        os.utime(folder / name, (now - age,) * 2)
    with open_cache().workshop():
        pass
    assert {path.name for path in folder.iterdir()} == {name for name, (_, stays) in cases.items() if stays}


def test_the_current_folder_has_no_say(folder, monkeypatch, tmp_path):
    """Neither a package `ziglang` there, nor a program `cc`, even if the search path names that folder."""
    for place in (tmp_path / "ziglang", tmp_path):
        place.mkdir(exist_ok=True)
        for name in ("cc", "zig"):
            (place / name).write_text("#!/bin/sh\n")
            (place / name).chmod(0o755)
    (tmp_path / "ziglang" / "__init__.py").touch()
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.syspath_prepend("")
    for path in ("", ".", f".{os.pathsep}"):
        monkeypatch.setenv("PATH", path)
        with suppress(tailored.CompilerError):
            assert not Path(tailored.compiler()[0]).is_relative_to(tmp_path)


@posix
def test_compilers_run_in_a_folder_of_their_own(folder, monkeypatch, tmp_path):
    """So `$CC` may be a Python module, or leave files where it works."""
    script = tmp_path / "compiler.py"
    script.write_text(f"import os; open({str(tmp_path / 'seen')!r}, 'a').write(os.getcwd() + ' '); open('left', 'w')\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CC", f"{sys.executable} {script}")
    monkeypatch.setattr(tailored, "SOURCES", shutil.copytree(tailored.SOURCES, tmp_path / "sources"))
    rumo.RealTimeIteration(pendulum(), backend="tailored")
    assert all(
        not Path(place).exists() or place == str(tmp_path / "sources")
        for place in (tmp_path / "seen").read_text().split()
    )
    assert not (tmp_path / "left").exists()
    assert not list(folder.iterdir())
