"""Only what is missing is done, and what is done is stored, whatever ends a campaign."""

import os
import signal
import subprocess
import sys
import time
from threading import Timer

import fake_work
import pandas as pd
import pytest
from fake_work import Tasks, task

import rumo.campaigns.store.parts
from rumo.campaigns.carrying_out import carry_out
from rumo.campaigns.engines import DaskEngine, SerialEngine
from rumo.campaigns.standing import Standing, in_words
from rumo.campaigns.store import Store, read_rows
from rumo.errors import CampaignError

SPECIFICATION = {"name": "a"}
WORK = "fake_work:behave"


def carried_out(folder, tasks, common=None, tell=None, **options):
    with Store(folder, SPECIFICATION) as store:
        return carry_out(WORK, common or {}, tasks, SerialEngine(), store, tell, **options)


def what_counts(frame):
    """All that must be the same, however often and where runs were made."""
    frame = frame.drop(columns=[name for name in frame.columns if name.startswith("run.")] + ["attempts"])
    return frame.sort_values("key", ignore_index=True)


def test_all_is_done_once_and_told(tmp_path):
    told = []
    last = carried_out(tmp_path, Tasks(7, lambda number: "raise" if number == 3 else "quick"), tell=told.append)
    assert [standing.done for standing in told] == list(range(8))
    assert last == told[-1]
    assert (last.every, last.failed, last.left) == (7, 1, 0.0)
    assert list(read_rows(tmp_path)["draw"]) == list(range(7))
    assert len(list((tmp_path / "rows").iterdir())) == 1
    assert [path.name for path in (tmp_path / "logs").iterdir()] == ["raise-3-rti.nc"]


def test_only_what_is_missing_is_done(tmp_path):
    tasks = [task(number, "note") for number in range(4)]
    common = {"folder": str(tmp_path)}
    carried_out(tmp_path / "c", tasks[:2], common)
    told = []
    carried_out(tmp_path / "c", tasks, common, told.append)
    assert (told[0].before, told[0].done, told[-1].done) == (2, 2, 4)
    made = [line.rpartition(" ")[0] for line in (tmp_path / "made").read_text().splitlines()]
    assert made == [each["key"] for each in tasks]
    assert len(read_rows(tmp_path / "c")) == 4


def test_failed_runs_are_made_again_on_demand(tmp_path):
    tasks = [task(number, how) for number, how in enumerate(["quick", "raise", "note"])]
    common = {"folder": str(tmp_path / "nowhere")}
    carried_out(tmp_path, tasks, common)
    assert list(read_rows(tmp_path)["outcome"]) == ["done", "raised", "raised"]
    (tmp_path / "nowhere").mkdir()
    carried_out(tmp_path, tasks, common)
    assert list(read_rows(tmp_path)["outcome"]) == ["done", "raised", "raised"]
    carried_out(tmp_path, tasks, common, retry_failed=True)
    assert list(read_rows(tmp_path)["outcome"]) == ["done", "raised", "done"]


@pytest.mark.parametrize("retry", [False, True])
def test_failures_among_the_first_are_told(tmp_path, retry):
    tasks = Tasks(6, lambda number: "raise" if number in (1, 4) else "quick")
    first = carried_out(tmp_path, list(tasks)[:2], every=6)
    told = []
    last = carried_out(tmp_path, tasks, tell=told.append, after=first, retry_failed=retry)
    assert (first.failed, told[0].failed, last.failed) == (1, 0 if retry else 1, 2)


def test_logs_are_asked_for_while_they_are_kept(tmp_path, monkeypatch):
    monkeypatch.setattr("rumo.campaigns.store.store.MOST_LOGS", 2)
    carried_out(tmp_path, Tasks(4, lambda number: "log"))
    assert list(read_rows(tmp_path)["kpi.asked"]) == [True, True, False, False]
    assert len(list((tmp_path / "logs").iterdir())) == 2


def test_files_that_have_changed_end_it_and_what_is_done_is_kept(tmp_path):
    tasks = Tasks(5, lambda number: "changed" if number == 3 else "quick")
    with pytest.raises(CampaignError, match="got another file"):
        carried_out(tmp_path, tasks)
    assert list(read_rows(tmp_path)["draw"]) == [0, 1, 2]


@pytest.mark.parametrize("engine", ["serial", "embedded"])
def test_rows_do_not_wait_for_a_run_that_takes_long(tmp_path, monkeypatch, engine):
    monkeypatch.setattr("rumo.campaigns.store.store.PAUSE", 0.2)
    tasks = [task(0), task(1), task(2, "wait for rows")]
    with (
        SerialEngine() if engine == "serial" else DaskEngine(workers=1) as carrying,
        Store(tmp_path, SPECIFICATION) as store,
    ):
        carry_out(WORK, {"campaign": str(tmp_path)}, tasks, carrying, store)
    assert read_rows(tmp_path)["kpi.parts"][2] == 1


def test_ctrl_c_keeps_what_has_come(tmp_path):
    def stop(standing):
        if standing.done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        carried_out(tmp_path, Tasks(5), tell=stop)
    assert len(read_rows(tmp_path)) == 3
    carried_out(tmp_path, Tasks(5))
    assert len(read_rows(tmp_path)) == 5


@pytest.mark.skipif(os.name != "posix", reason="Windows has no SIGINT for one process")
def test_ctrl_c_within_a_run(tmp_path):
    timer = Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    with pytest.raises(KeyboardInterrupt):
        carried_out(
            tmp_path,
            [task(0), task(1, "never end")],
            tell=lambda standing: timer.start() if standing.done == 1 else None,
        )
    assert list(read_rows(tmp_path)["key"]) == ["quick-0-rti"]


def test_a_full_disk_ends_it_and_it_goes_on_later(tmp_path, monkeypatch):
    def write_whole(path, write, **options):
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr("rumo.campaigns.store.store.PART", 3)
    carried_out(tmp_path, Tasks(2))
    with monkeypatch.context() as patch:
        patch.setattr(rumo.campaigns.store.parts, "write_whole", write_whole)
        with pytest.raises(CampaignError, match="No space left on device"):
            carried_out(tmp_path, Tasks(20))
    assert len(read_rows(tmp_path)) == 2
    carried_out(tmp_path, Tasks(20))
    assert list(read_rows(tmp_path)["draw"]) == list(range(20))


def test_rows_that_a_full_disk_has_kept_out_are_tried_once_more(tmp_path, monkeypatch):
    write, calls = rumo.campaigns.store.parts.write_whole, []

    def write_whole(path, *arguments, **options):
        calls.append(path)
        if len(calls) == 1:
            raise OSError(28, "No space left on device", str(path))
        return write(path, *arguments, **options)

    monkeypatch.setattr("rumo.campaigns.store.store.PART", 3)
    monkeypatch.setattr(rumo.campaigns.store.parts, "write_whole", write_whole)
    with pytest.raises(CampaignError, match="No space left on device"):
        carried_out(tmp_path, Tasks(20))
    assert len(read_rows(tmp_path)) == 3


CLIENT = """
import sys
from pathlib import Path
from fake_work import MIXED, mixed_tasks
from rumo.campaigns.carrying_out import carry_out
from rumo.campaigns.engines import DaskEngine, SerialEngine
from rumo.campaigns.store import Store

folder, engine = Path(sys.argv[1]), sys.argv[2]
import rumo.campaigns.store.store
rumo.campaigns.store.store.PART = 5
chosen = SerialEngine() if engine == "serial" else DaskEngine(workers=2) if engine == "embedded" else DaskEngine(engine)
common = MIXED | {"folder": str(folder)}
tell = lambda standing: print(standing.done, flush=True)
with Store(folder / "campaign", {}) as store:
    try:
        carry_out("fake_work:behave", common, mixed_tasks(40), chosen, store, tell)
    finally:
        chosen.close()
"""


@pytest.mark.skipif(sys.platform != "linux", reason="looks for processes' children")
@pytest.mark.parametrize("engine", [pytest.param("serial", marks=pytest.mark.slow), "embedded"])
def test_killed_and_started_again_it_comes_to_the_same(tmp_path, engine):
    """The client, and a process that is at a run, are killed in the middle; one run crashes each time."""
    undisturbed, disturbed = tmp_path / "undisturbed", tmp_path / "disturbed"
    for folder in (undisturbed, disturbed):
        folder.mkdir()
    with started(disturbed, engine) as client:
        lines = iter(client.stdout.readline, "")
        assert any(int(line) >= 12 for line in lines)
        children_of(client.pid)[0].kill()
        assert any(int(line) >= 22 for line in lines)
        client.kill()
    before = len(read_rows(disturbed / "campaign"))
    assert 15 <= before < 40
    for folder in (disturbed, undisturbed):
        with started(folder, engine) as client:
            client.communicate()
        assert client.returncode == 0
    one, other = (what_counts(read_rows(folder / "campaign")) for folder in (disturbed, undisturbed))
    pd.testing.assert_frame_equal(one, other)
    assert list(one["outcome"].value_counts().items()) == [("done", 38), ("raised", 1), ("crashed", 1)]


def started(folder, engine):
    environment = os.environ | {"PYTHONPATH": os.path.dirname(fake_work.__file__)}
    return subprocess.Popen(
        [sys.executable, "-c", CLIENT, folder, engine], env=environment, stdout=subprocess.PIPE, text=True
    )


def children_of(number):
    import psutil

    deadline = time.monotonic() + 10.0
    while not (children := psutil.Process(number).children()):
        assert time.monotonic() < deadline
    return children


def test_standing_in_words():
    assert str(Standing(200, 0, 0, 0, 0.0)) == "0/200 runs"
    assert str(Standing(200, 100, 150, 2, 10.0)) == "150/200 runs, 2 failed, 5/s, 10 s left"
    assert str(Standing(9000, 0, 10, 0, 100.0)) == "10/9000 runs, 0.1/s, 24 h 58 min left"
    assert [in_words(seconds) for seconds in (0.0, 99.0, 100.0, 5000.0, 6000.0)] == [
        "0 s",
        "99 s",
        "2 min",
        "83 min",
        "1 h 40 min",
    ]
