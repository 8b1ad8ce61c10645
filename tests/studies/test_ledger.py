"""What came of runs is kept line by line, and is taken up only where it is whole and of the same settings."""

import pytest

import rumo
from rumo.studies.ledger import Ledger

SAME = {"study": "a", "sizes": (1, 2), "gate": None}
OUTCOMES = {
    ("rti", "none", 8.0, 5, 0): {"error": 0.1, "lost": False},
    ("rti", "heavy", 8.0, "whole", 1): {"error": None},
}


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "results.jsonl"
    ledger = Ledger(path, SAME, resume=True)
    assert not ledger.done
    for key, outcome in OUTCOMES.items():
        ledger.add(key, outcome)
    return path


def test_what_was_done_is_found_again(path):
    assert Ledger(path, SAME, resume=True).done == OUTCOMES
    assert not Ledger(path, SAME, resume=False).done
    assert not Ledger(path, SAME, resume=True).done


@pytest.mark.parametrize("damage", [b'{"key": ["rti"', b"{}", b"\xff\xfe\n", b"[1]\n", b'{"outcome": {}}\n', b"\n"])
def test_a_damaged_line_ends_what_is_found(path, damage):
    head, first, second = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(head + first + damage + b"\n" + second)
    ledger = Ledger(path, SAME, resume=True)
    assert list(ledger.done) == list(OUTCOMES)[:1]
    ledger.add(("ltv", 1), {})
    assert list(Ledger(path, SAME, resume=True).done) == [next(iter(OUTCOMES)), ("ltv", 1)]


def test_a_file_without_a_head_is_begun_anew(path):
    path.write_bytes(b"")
    assert not Ledger(path, SAME, resume=True).done


@pytest.mark.parametrize(("change", "name"), [({"gate": {"width": 1.0}}, "gate"), ({"sizes": (1,)}, "sizes")])
def test_other_settings_are_named(path, change, name):
    with pytest.raises(rumo.ArgumentError, match=f"--resume: got .* of another {name}, .*Leave --resume out"):
        Ledger(path, SAME | change, resume=True)
    assert Ledger(path, SAME, resume=True).done == OUTCOMES


def test_another_version_is_named(path, monkeypatch):
    monkeypatch.setattr("rumo.studies.ledger.__version__", "0")
    with pytest.raises(rumo.ArgumentError, match="of another rumo_version"):
        Ledger(path, SAME, resume=True)
