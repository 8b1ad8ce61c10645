"""Of several that want a lock one has it, until it is done or dead."""

import multiprocessing
import os
from pathlib import Path
from threading import Thread

import pytest

from rumo.locks import locked


def test_one_at_a_time(tmp_path):
    path = tmp_path / "lock"
    with locked(path, 0.0) as first:
        assert first
        with locked(path, 0.1) as second:
            assert not second
        assert path.exists()
    assert not path.exists()
    with locked(path, 0.0) as third:
        assert third


def count_up(folder):
    """Read, and write one more, which loses counts if two do so at once."""
    counter = Path(folder) / "counter"
    for _ in range(20):
        with locked(Path(folder) / "lock", 60.0) as mine:
            assert mine
            counter.write_text(str(int(counter.read_text()) + 1))


@pytest.mark.parametrize("kind", ["threads", "processes"])
def test_many_who_take_turns(tmp_path, monkeypatch, kind):
    monkeypatch.setattr("rumo.locks.PAUSE", 0.001)
    (tmp_path / "counter").write_text("0")
    make = Thread if kind == "threads" else multiprocessing.get_context("spawn").Process
    others = [make(target=count_up, args=(tmp_path,)) for _ in range(3)]
    for other in others:
        other.start()
    for other in others:
        other.join()
    assert (tmp_path / "counter").read_text() == "60"
    assert os.listdir(tmp_path) == ["counter"]


def test_a_place_where_there_can_be_none(tmp_path):
    with pytest.raises(FileNotFoundError), locked(tmp_path / "nowhere" / "lock", 0.0):
        pass
