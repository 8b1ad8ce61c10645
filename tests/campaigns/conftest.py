"""What several tests of campaigns need."""

import os
import tomllib
from contextlib import ExitStack

import pytest
from dask_cluster import Cluster
from fake_tuning import TEXT

from rumo.campaigns.tuning.reading import tuning_of


@pytest.fixture
def quick_disks(monkeypatch):
    """Files are not waited for until they are on a disk."""
    monkeypatch.setattr(os, "fsync", lambda descriptor: None)


@pytest.fixture(scope="session")
def tuning():
    """What drives that are made up are tuned by."""
    return tuning_of(tomllib.loads(TEXT))


@pytest.fixture
def cluster(tmp_path):
    """One that can be started, and ends with the test."""
    with ExitStack() as stack:
        yield Cluster(stack, tmp_path)
