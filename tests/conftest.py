"""Makes `problems` importable from every test folder, and the C core the portable one: it needs no compiling.

Tests run on all cores: matrices as small as these gain nothing from further threads.
"""

import gc
import os
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
os.environ.setdefault("RUMO_BACKEND", "portable")
for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(name, "1")


@pytest.fixture(autouse=True, scope="module")
def little_to_collect():
    """Each simulation collects garbage before it begins, but not what was there when a file began."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session")
def shared_folder(tmp_path_factory):
    """A folder of this test run, the same for all workers."""
    base = tmp_path_factory.getbasetemp()
    return base.parent if "PYTEST_XDIST_WORKER" in os.environ else base


@pytest.fixture
def kept_builds(shared_folder, monkeypatch):
    """Tailored builds are kept for the rest of this test run."""
    monkeypatch.setenv("RUMO_CACHE", str(shared_folder / "builds"))


def pytest_sessionfinish():
    gc.unfreeze()
