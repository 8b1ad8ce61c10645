"""What several tests of campaigns need."""

import os
import tomllib

import pytest
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
