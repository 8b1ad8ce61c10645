"""Workers, schedulers and clients are killed in the middle of a campaign: at the end all rows are there."""

import sys
from contextlib import contextmanager
from pathlib import Path

import pandas as pd
import pytest
from dask_cluster import end
from test_carrying_out import started, what_counts

from rumo.campaigns.store import read_rows

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform != "linux", reason="kills processes by signals")]


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
