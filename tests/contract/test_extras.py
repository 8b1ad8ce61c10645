"""Packages that are installed only where they are wanted."""

import sys

import pytest

import rumo
from rumo.extras import required


def test_one_that_is_there_is_imported():
    assert required("json.decoder", "gym", "x") is sys.modules["json.decoder"]


def test_one_that_is_missing_has_a_cure():
    with pytest.raises(rumo.ArgumentError, match=r'x: got an installation without nowhere.*pip install "rumo\[gym\]"'):
        required("nowhere.module", "gym", "x")


def test_one_that_is_broken_says_so_itself(tmp_path, monkeypatch):
    (tmp_path / "broken_package.py").write_text("import what_it_needs")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ModuleNotFoundError, match="what_it_needs"):
        required("broken_package", "gym", "x")
