"""Whatever a run does, it becomes one row, and the next one goes on."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from threading import Timer

import fake_work
import numpy as np
import pytest
from fake_work import task

import rumo
from rumo.campaigns.tasks.last_words import last_words
from rumo.campaigns.tasks.rows import plain
from rumo.campaigns.tasks.supervised import ClosedError, Supervised

posix = pytest.mark.skipif(os.name != "posix", reason="Windows has no signals of this kind")
linux = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere it ends when Python's threads get a turn")
TIMEOUT = 0.6


@pytest.fixture(scope="module")
def process(tmp_path_factory):
    with Supervised(
        "fake_work:behave", {"timeout": TIMEOUT, "folder": str(tmp_path_factory.mktemp("runs"))}
    ) as process:
        yield process


def test_a_run_that_comes_to_its_end(process):
    row = process.run(task(3, "quick", "ltv", x=1.5, names=["a", 1]))
    assert row["run.wall_time_s"] > 0.0
    assert {name: value for name, value in row.items() if not name.startswith("run.")} == {
        "key": "quick-3-ltv",
        "draw": 3,
        "controller": "ltv",
        "outcome": "done",
        "error": None,
        "attempts": 1,
        "setting.how": "quick",
        "setting.x": 1.5,
        "setting.names": '["a", 1]',
        "kpi.double": 3.0,
        "ended": None,
    }


ENDS = {
    "raise": ("raised", 1, "ValueError: lost\nthe way\n", "in raise_with_a_log"),
    "leave": ("raised", 1, "SystemExit: 4", "fake_work.py"),
    "deep": ("raised", 1, "RecursionError: maximum recursion depth", "in deep"),
    "no plain data": ("raised", 1, "TypeError: kpi.what: a row cannot keep object", ""),
    "exit": ("crashed", 2, "its process ended with exit code 3", ""),
    "segfault": (
        "crashed",
        2,
        "ended by SIGSEGV (Segmentation fault)\nabout to fail\nFatal Python error",
        "in segfault",
    ),
    "hang": ("timeout", 1, "longer than 0.6 s\nTimeout", "in hang"),
    "hang with the GIL": ("timeout", 1, "longer than 0.6 s\nTimeout", "in hang_with_the_gil"),
}


@posix
@pytest.mark.parametrize("how", ENDS)
def test_a_run_that_does_not(process, how):
    row = process.run(task(1, how))
    outcome, attempts, begin, where = ENDS[how]
    assert (row["key"], row["outcome"], row["attempts"]) == (f"{how}-1-rti", outcome, attempts)
    assert begin in row["error"]
    assert where in row["error"]
    assert len(row["error"]) < 4100
    assert "child.py" not in row["error"]
    assert row.get("log") == (b"so far" if how == "raise" else None)
    assert (row["run.wall_time_s"] >= TIMEOUT) == (outcome == "timeout")
    assert process.run(task(2))["outcome"] == "done"


@posix
@pytest.mark.parametrize("how", ["killed once", "noisy", "huge", "interrupted", "use up memory"])
def test_a_run_that_does_in_the_end(process, how):
    row = process.run(task(1, how))
    if how == "use up memory":
        assert row["error"].startswith("MemoryError")
        process.close()
    else:
        assert (row["outcome"], row["attempts"]) == ("done", 2 if how == "killed once" else 1)
    assert len(row.get("log") or b"") == (30_000_000 if how == "huge" else 0)


def test_one_thread_for_linear_algebra():
    with Supervised("fake_work:behave", {}) as process:
        row = process.run(task(1, "threads"))
    assert row["threads"] == "1"
    assert row["cwd"] == sys.path[0]


@posix
def test_a_process_that_was_killed_while_nothing_ran_costs_no_attempt():
    with Supervised("fake_work:behave", {}) as process:
        assert process.pid is None
        process.run(task(1))
        before = process.pid
        os.kill(before, signal.SIGKILL)
        time.sleep(0.1)
        assert process.run(task(2))["attempts"] == 1
        assert process.pid != before


def test_preparation_does_not_count():
    with Supervised("fake_work:behave", {"timeout": 0.2, "preparation": 0.4}) as process:
        assert process.run(task(1))["outcome"] == "done"


@pytest.mark.parametrize(
    ("work", "common", "reason"),
    [
        ("fake_work:nothing", {}, "cannot be loaded: AttributeError: module 'fake_work' has no attribute 'nothing'"),
        ("no_such_module:behave", {}, "cannot be loaded: ModuleNotFoundError: No module named 'no_such_module'"),
    ],
)
def test_work_that_cannot_be_loaded(work, common, reason):
    with Supervised(work, common) as process, pytest.raises(rumo.errors.CampaignError) as caught:
        process.run(task(1))
    assert reason in str(caught.value)


@posix
@pytest.mark.parametrize("how", ["broken", "crashing", "hanging"])
def test_where_preparing_fails_runs_say_what_they_come_to(monkeypatch, how):
    monkeypatch.setattr("rumo.campaigns.tasks.supervised.SLACK", 0.1)
    begun = time.monotonic()
    with Supervised("fake_work:behave", {how: True, "timeout": 0.4}) as process:
        for number in range(2):
            row = process.run(task(number))
            assert (row["outcome"], row["attempts"]) == ("done", 1)
            os.kill(process.pid, signal.SIGKILL)
            time.sleep(0.05)
    assert time.monotonic() - begun < 30.0


def test_files_that_have_changed_are_no_outcome_of_a_run():
    with Supervised("fake_work:behave", {}) as process:
        with pytest.raises(rumo.errors.CampaignError, match="scenario: got another file, expected the file that it be"):
            process.run(task(1, "changed"))
        assert process.run(task(2))["outcome"] == "done"


def test_a_run_that_is_no_more_wanted():
    process = Supervised("fake_work:behave", {})
    process.run(task(0))
    timer = Timer(0.2, process.close)
    timer.start()
    with pytest.raises(ClosedError):
        process.run(task(1, "never end"))
    with pytest.raises(ClosedError):
        process.run(task(1))
    assert process.pid is None


PARENT = """
import sys
from threading import Thread
from time import sleep
from fake_work import task
from rumo.campaigns.tasks.supervised import Supervised
process = Supervised("fake_work:behave", {})
process.run(task(0))
Thread(target=process.run, args=[task(1, sys.argv[1])], daemon=True).start()
sleep(0.2)
print(process.pid, flush=True)
sleep(60)
"""


@linux
@pytest.mark.parametrize("how", ["hang", "hang with the GIL", "never end"])
def test_it_ends_when_its_parent_has_gone(how):
    environment = os.environ | {"PYTHONPATH": os.path.dirname(fake_work.__file__)}
    command = [sys.executable, "-c", PARENT, how]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as parent:
        number = int(parent.stdout.readline())
        assert is_running(number)
        parent.kill()
    deadline = time.monotonic() + 10.0
    while is_running(number):
        assert time.monotonic() < deadline
        time.sleep(0.01)


def is_running(number):
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.slow
@posix
def test_thousands_of_runs_and_hundreds_of_crashes_leave_nothing():
    import psutil

    own = psutil.Process()
    with Supervised("fake_work:behave", {}) as process:
        for number in range(20):
            process.run(task(number, "exit"))
        process.run(task(0))
        files, threads, memory = own.num_fds(), own.num_threads(), own.memory_info().rss
        for number in range(100):
            process.run(task(number, "exit"))
        process.run(task(0))
        child = psutil.Process(process.pid)
        before = child.memory_info().rss
        for number in range(20_000):
            process.run(task(number, "raise" if number % 2 else "quick"))
        assert child.memory_info().rss < before + 2e6
        assert own.memory_info().rss < memory + 10e6
        assert (own.num_fds(), own.num_threads()) == (files, threads)


def test_values_become_plain():
    for value, kept in [
        (np.float64(0.5), 0.5),
        (np.int32(3), 3),
        (np.bool_(True), True),
        (np.array(2.5), 2.5),
        ((1, 2), "[1, 2]"),
        (None, None),
        (np.str_("a"), "a"),
    ]:
        found = plain(value, "x")
        assert found == kept
        assert type(found) is type(kept)
    with pytest.raises(TypeError, match=r"^x: a row cannot keep ndarray"):
        plain(np.zeros(2), "x")


def test_last_words_are_few():
    dump = "Fatal Python error: Aborted\n\nThread 0x1 (most recent call first):\n" + '  File "a.py", line 1 in other\n'
    own = "\nCurrent thread 0x2 (most recent call first):\n" + '  File "b.py", line 2 in inner\n' * 30
    own += '  File "/campaigns/tasks/child.py", line 9 in _answer\n  File "/campaigns/tasks/child.py", line 9 in main\n'
    words = last_words("y" * 9000 + "said\n" + dump + own + "\nExtension modules: " + "numpy, " * 2000)
    assert words.count("b.py") == 10
    assert "said\nFatal Python error: Aborted\n  File" in words
    assert "numpy" not in words
    assert "a.py" not in words
    assert len(words) <= 2000
    assert last_words("  only this\n") == "only this"
