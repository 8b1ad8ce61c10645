"""Workers, schedulers and clients are killed in the middle of a campaign: at the end all rows are there."""

import json
import os
import subprocess
import sys
import time
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import fake_work
import pandas as pd
import pytest
from test_carrying_out import started, what_counts

from rumo.campaigns.store import read_rows

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform != "linux", reason="kills processes by signals")]
ENVIRONMENT = os.environ | {"PYTHONPATH": os.path.dirname(fake_work.__file__)}


class Cluster:
    """A scheduler and workers as `dask scheduler` and `dask worker` start them, on this machine alone."""

    def __init__(self, stack, folder):
        self._stack, self._file = stack, folder / "scheduler.json"
        self.address, self.scheduler, self.workers = "", None, []

    def start(self, workers):
        self._file.unlink(missing_ok=True)
        place = ["--host", "127.0.0.1", "--port", "0", "--dashboard-address", "127.0.0.1:0"]
        self.scheduler = self._dask("scheduler", *place, "--scheduler-file", self._file)
        while not (self._file.exists() and self._file.read_text().rstrip().endswith("}")):
            time.sleep(0.05)
        self.address = json.loads(self._file.read_text())["address"]
        for _ in range(workers):
            self.add_worker()

    def add_worker(self):
        place = ["--host", "127.0.0.1", "--dashboard-address", "127.0.0.1:0", "--nthreads", "1", "--no-nanny"]
        folder = self._file.with_name(f"worker-{len(self.workers)}")
        self.workers.append(self._dask("worker", self.address, *place, "--local-directory", folder))

    def _dask(self, kind, *arguments):
        command = [sys.executable, "-m", f"distributed.cli.dask_{kind}", *map(str, arguments)]
        process = subprocess.Popen(command, env=ENVIRONMENT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self._stack.callback(end, process)
        return process


def end(process):
    with suppress(ProcessLookupError):
        process.kill()
    process.wait()


@pytest.fixture
def cluster(tmp_path):
    with ExitStack() as stack:
        yield Cluster(stack, tmp_path)


@contextmanager
def campaign(folder, engine):
    folder.mkdir(exist_ok=True)
    with started(folder, engine) as client:
        yield client, iter(client.stdout.readline, "")
        client.kill()


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed")
    with campaign(folder, "serial") as (client, _):
        client.communicate()
    return what_counts(read_rows(folder / "campaign"))


def assert_complete(folder, undisturbed):
    pd.testing.assert_frame_equal(what_counts(read_rows(folder / "campaign")), undisturbed)
    keys = pd.concat(pd.read_parquet(part)["key"] for part in Path(folder / "campaign" / "rows").glob("*.parquet"))
    assert keys.is_unique


def test_workers_that_are_killed(cluster, tmp_path, undisturbed):
    cluster.start(2)
    with campaign(tmp_path / "c", cluster.address) as (client, lines):
        assert any(int(line) >= 5 for line in lines)
        end(cluster.workers[0])
        assert any(int(line) >= 15 for line in lines)
        cluster.add_worker()
        end(cluster.workers[1])
        client.communicate(timeout=60)
        assert client.returncode == 0
    assert_complete(tmp_path / "c", undisturbed)


def test_a_client_that_is_killed(cluster, tmp_path, undisturbed):
    cluster.start(2)
    with campaign(tmp_path / "c", cluster.address) as (client, lines):
        assert any(int(line) >= 12 for line in lines)
        client.kill()
    with campaign(tmp_path / "c", cluster.address) as (client, lines):
        assert int(next(lines)) >= 5
        client.communicate(timeout=60)
        assert client.returncode == 0
    assert_complete(tmp_path / "c", undisturbed)


def test_a_scheduler_that_is_killed(cluster, tmp_path, undisturbed):
    cluster.start(2)
    with campaign(tmp_path / "c", cluster.address) as (client, lines):
        assert any(int(line) >= 12 for line in lines)
        end(cluster.scheduler)
        client.communicate(timeout=60)
        assert client.returncode == 1
    assert len(read_rows(tmp_path / "c" / "campaign")) >= 12
    cluster.start(1)
    with campaign(tmp_path / "c", cluster.address) as (client, _):
        client.communicate(timeout=60)
        assert client.returncode == 0
    assert_complete(tmp_path / "c", undisturbed)
