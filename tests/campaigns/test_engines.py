"""The same rows wherever they are made, on sockets that nobody else can reach."""

import os
import socket
import subprocess
import sys
import time
from contextlib import contextmanager, nullcontext
from importlib.metadata import PackageNotFoundError
from types import SimpleNamespace

import fake_work
import pandas as pd
import pytest
from fake_work import MIXED, Tasks, mixed_tasks, task

import rumo
from rumo.campaigns.engines import DaskEngine, SerialEngine, on_worker
from rumo.campaigns.engines.on_worker import Pool
from rumo.campaigns.tasks.supervised import ClosedError
from rumo.campaigns.tasks.task import Engine
from rumo.errors import CampaignError

psutil = pytest.importorskip("psutil")
WORK = "fake_work:behave"
COUNT = 60
PYTHONPATH = {"PYTHONPATH": os.path.dirname(fake_work.__file__)}
CLUSTER = """
import sys
from distributed import LocalCluster
options = dict(host="127.0.0.1", protocol="tcp", dashboard_address="127.0.0.1:0")
options |= dict(worker_dashboard_address="127.0.0.1:0")
cluster = LocalCluster(n_workers=int(sys.argv[1]), threads_per_worker=1, processes=False, **options)
print(cluster.scheduler_address, flush=True)
sys.stdin.read()
"""


@contextmanager
def existing_cluster(workers):
    """Scheduler and workers in a process of their own; its address."""
    command = [sys.executable, "-W", "ignore", "-c", CLUSTER, str(workers)]
    with subprocess.Popen(
        command, env=os.environ | PYTHONPATH, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        try:
            yield process.stdout.readline().strip()
        finally:
            process.kill()


@pytest.fixture(scope="module")
def embedded():
    with DaskEngine(workers=2) as engine:
        yield engine


def rows_of(engine, tasks, common):
    rows = sorted(engine.rows(WORK, common, tasks), key=lambda row: row["key"])
    return [{name: value for name, value in row.items() if name[:4] != "run."} for row in rows]


@pytest.fixture(scope="module")
def serial_rows():
    return rows_of(SerialEngine(), mixed_tasks(COUNT), MIXED)


def test_serially(serial_rows):
    assert len(serial_rows) == COUNT
    outcomes = pd.Series([row["outcome"] for row in serial_rows]).value_counts()
    assert dict(outcomes) == {"done": COUNT - 2, "raised": 1, "crashed": 1}


def test_embedded(embedded, serial_rows):
    engine: Engine = embedded
    assert engine.workers == 2
    assert rows_of(embedded, mixed_tasks(COUNT), MIXED) == serial_rows


def test_on_a_cluster_that_exists(serial_rows, monkeypatch):
    with existing_cluster(2) as address:
        with DaskEngine(address) as engine:
            assert engine.workers == 2
            assert rows_of(engine, mixed_tasks(COUNT), MIXED) == serial_rows
        assert_refused(address, monkeypatch, lambda *_: "98.0", r"a scheduler with Rumo 98.0")
        assert_refused(address, monkeypatch, raise_not_found, r"a scheduler with no Rumo \(No package metadata")
        with monkeypatch.context() as patch:
            patch.setattr("rumo.campaigns.engines.dask.__version__", "99.0")
            assert_refused(address, monkeypatch, lambda *_: "99.0", r"a worker at .* with Rumo .*, expected Rumo 99")


def raise_not_found(*_):
    raise PackageNotFoundError("rumo")


def assert_refused(address, monkeypatch, of_scheduler, why):
    """Where a scheduler says that of its version."""
    with monkeypatch.context() as patch:
        patch.setattr("distributed.Client.run_on_scheduler", of_scheduler)
        with pytest.raises(rumo.ArgumentError, match=f"scheduler: got .*{why}"):
            DaskEngine(address)


@pytest.mark.parametrize(
    ("address", "reason"),
    [
        ("tcp://127.0.0.1:9", "Connection refused"),
        ("127.0.0.1:x", "invalid literal"),
        ("localhost", "invalid literal"),
        ("", "invalid literal"),
    ],
)
def test_a_scheduler_that_is_not_there(address, reason):
    with pytest.raises(rumo.ArgumentError, match=r"scheduler: got .* no scheduler answers .*, expected the") as caught:
        DaskEngine(address)
    assert reason in str(caught.value)


def test_somebody_else_in_the_place_of_a_scheduler(monkeypatch):
    monkeypatch.setattr("rumo.campaigns.engines.dask.PATIENCE", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        with pytest.raises(rumo.ArgumentError, match="no scheduler answers"):
            DaskEngine(address)


def test_a_scheduler_without_workers(monkeypatch):
    monkeypatch.setattr("rumo.campaigns.engines.dask.WORKER_PATIENCE", 0.3)
    with existing_cluster(0) as address, pytest.raises(rumo.ArgumentError, match="which has no workers"):
        DaskEngine(address)


def test_no_socket_off_loopback(embedded):
    rows = embedded.rows(WORK, {}, Tasks(1000))
    next(rows)
    own = psutil.Process()
    sockets = [socket for each in (own, *own.children(recursive=True)) for socket in each.net_connections("inet")]
    assert {socket.laddr.ip for socket in sockets} <= {"127.0.0.1", "::1"}
    rows.close()


def test_runs_that_are_no_more_wanted_end_at_once(embedded):
    own = psutil.Process()
    others = {*own.children()}
    rows = embedded.rows(WORK, {"new": True}, [task(0), task(1, "never end"), task(2, "never end")])
    next(rows)
    time.sleep(0.3)
    begun = time.monotonic()
    rows.close()
    while {*own.children()} - others:
        assert time.monotonic() - begun < 5.0, own.children()
        time.sleep(0.01)
    assert rows_of(embedded, [task(0)], {})[0]["outcome"] == "done"


def test_more_tasks_than_memory_should_hold(embedded):
    read = []

    def tasks():
        for number in range(10**9):
            read.append(number)
            yield task(number)

    rows = embedded.rows(WORK, {}, tasks())
    for _ in range(50):
        next(rows)
    rows.close()
    assert len(read) < 100_000


def test_batches_come_back_before_all_of_a_batch_is_done(embedded, serial_rows, monkeypatch):
    monkeypatch.setattr(on_worker, "LONGEST", 0.05)
    assert rows_of(embedded, mixed_tasks(COUNT), MIXED) == serial_rows


def test_rows_of_a_batch_do_not_wait_for_a_run_that_takes_long(monkeypatch):
    monkeypatch.setattr(on_worker, "LONGEST", 0.2)
    monkeypatch.setattr("rumo.campaigns.tasks.process.HEARTBEAT", 0.05)
    begin = rumo.__version__, "a campaign", WORK, {"timeout": 0.6}
    rows, _ = on_worker.carry_out_batch(*begin, [task(0), task(1, "never end"), task(2)])
    assert [row["draw"] for row in rows] == [0]
    rows, _ = on_worker.carry_out_batch(*begin, [task(1, "never end"), task(2)])
    assert [(row["outcome"], row["attempts"]) for row in rows] == [("timeout", 1)]
    on_worker.end_campaign("a campaign")


def test_a_run_that_ends_each_worker(embedded, monkeypatch):
    from distributed import KilledWorker

    def kill(*begin):
        if any(each["draw"] == 7 for each in begin[-1]):
            raise KilledWorker("a batch", SimpleNamespace(address="somewhere"), 3)
        return on_worker.carry_out_batch(*begin)

    monkeypatch.setattr("rumo.campaigns.engines.dask.carry_out_batch", kill)
    rows = {row["draw"]: row for row in embedded.rows(WORK, {}, Tasks(30))}
    assert sorted(rows) == [*range(30)]
    assert {draw for draw, row in rows.items() if row["outcome"] != "done"} == {7}
    assert (rows[7]["outcome"], rows[7]["attempts"]) == ("crashed", 4)
    assert rows[7]["run.wall_time_s"] is rows[7]["run.started"] is None


@pytest.mark.parametrize("serial", [True, False])
def test_what_is_called_meanwhile_may_end_the_work(embedded, monkeypatch, serial):
    monkeypatch.setattr("rumo.campaigns.tasks.process.HEARTBEAT", 0.05)
    monkeypatch.setattr("rumo.campaigns.engines.dask.HEARTBEAT", 0.05)

    def fail():
        raise CampaignError("the disk is full")

    with SerialEngine() if serial else nullcontext(embedded) as engine:
        rows = engine.rows(WORK, {}, [task(0), task(1, "never end")], fail)
        with pytest.raises(CampaignError, match="the disk is full"):
            list(rows)
        # Not the answer of the run that was broken off.
        assert [row["key"] for row in engine.rows(WORK, {}, [task(2)])] == ["quick-2-rti"]


def test_work_that_cannot_be_loaded(embedded):
    with pytest.raises(CampaignError, match="cannot be loaded: AttributeError: module 'fake_work'"):
        list(embedded.rows("fake_work:nothing", {}, Tasks(5)))


def test_files_that_have_changed_end_it_after_what_is_done():
    tasks, begin = [task(0), task(1), task(2, "changed")], (rumo.__version__, "changed", WORK, {})
    rows, _ = on_worker.carry_out_batch(*begin, tasks)
    assert [row["draw"] for row in rows] == [0, 1]
    with pytest.raises(CampaignError, match="got another file"):
        on_worker.carry_out_batch(*begin, tasks[2:])
    on_worker.end_campaign("changed")


@pytest.mark.parametrize("serial", [True, False])
def test_one_campaign_at_a_time(embedded, serial):
    with SerialEngine() if serial else nullcontext(embedded) as engine:
        older, newer = (engine.rows(WORK, {"name": name}, Tasks(40)) for name in ("older", "newer"))
        next(older)
        next(newer)
        with pytest.raises(CampaignError, match="has begun another campaign"):
            list(older)
        assert len(list(newer)) == 39


def test_tasks_that_cannot_be_made(embedded):
    def tasks():
        yield task(0)
        raise ValueError("no more")

    with pytest.raises(ValueError, match="no more"):
        list(embedded.rows(WORK, {}, tasks()))


def test_an_empty_campaign(embedded):
    assert list(embedded.rows(WORK, {}, [])) == []


@pytest.mark.parametrize("workers", [0, 1.5, "2"])
def test_a_number_of_workers_that_is_none(workers):
    with pytest.raises(rumo.ArgumentError, match="workers"):
        DaskEngine(workers=workers)


def test_idle_processes_end(monkeypatch):
    monkeypatch.setattr(on_worker, "IDLE", 0.2)
    pool = Pool()
    process = pool.take("a", WORK, {})
    process.run(task(0))
    pool.give("a", process)
    assert pool.take("a", WORK, {}) is process
    pool.give("a", process)
    deadline = time.monotonic() + 5.0
    while process.pid is not None:
        assert time.monotonic() < deadline
        time.sleep(0.02)
    again = pool.take("a", WORK, {})
    assert again is not process
    pool.end("a")
    pool.give("a", again)
    with pytest.raises(ClosedError):
        pool.take("a", WORK, {})
