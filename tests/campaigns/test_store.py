"""Rows are kept whole: whatever ends the writer, what was stored can be read, each run once."""

import errno
import json
import multiprocessing
import os
import subprocess
import sys
from contextlib import suppress

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import rumo
import rumo.campaigns.store.parts
from rumo.campaigns.store.alone import LOCK
from rumo.campaigns.store.arrays import array_of, type_of
from rumo.campaigns.store.kinds import common_kind, converted, in_order, kind_of
from rumo.campaigns.store.store import PART, Store, read_head, read_rows
from rumo.errors import CampaignError, FileError

SPECIFICATION = {"name": "a", "runs": 3}


def row(number, outcome="done", **columns):
    return {"key": f"{number:04d}", "draw": number, "controller": "rti", "outcome": outcome, "attempts": 1, **columns}


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "new" / "campaign"


def stored(folder, *parts):
    """A campaign with these rows in these parts."""
    with Store(folder, SPECIFICATION) as store:
        for part in parts:
            for each in part:
                store.add(each)
            store.flush()


def files(folder):
    return sorted(path.name for path in (folder / "rows").iterdir())


def test_rows_are_found_again(folder):
    stored(folder, [row(0, x=1), row(1)], [row(2, "raised", error="no")])
    assert files(folder) == ["000001.parquet", "000002.parquet"]
    frame = read_rows(folder)
    assert list(frame.columns) == ["key", "draw", "controller", "outcome", "error", "attempts", "x"]
    assert list(frame["key"]) == ["0000", "0001", "0002"]
    with Store(folder, SPECIFICATION) as store:
        pd.testing.assert_frame_equal(store.rows(), frame)
        assert store.keys() == {"0000", "0001", "0002"}
        assert store.keys(failed=False) == {"0000", "0001"}
        store.add(row(3))
        store.flush()
    assert files(folder)[-1] == "000003.parquet"


def test_a_part_is_written_every_so_many_rows_or_seconds(folder, monkeypatch):
    with Store(folder, SPECIFICATION) as store:
        for number in range(PART + 1):
            store.add(row(number))
        assert len(read_rows(folder)) == PART
        monkeypatch.setattr("rumo.campaigns.store.store.PAUSE", 0.0)
        store.add(row(PART + 1))
        assert len(read_rows(folder)) == PART + 2


def test_columns_have_one_type_whichever_rows_came_first(folder):
    rows = [
        row(0, **{"kpi.a": None, "setting.n": 1, "setting.how": "auto", "setting.on": True, "kpi.b": 1}),
        row(1, **{"kpi.a": 2, "setting.n": 0.5, "setting.how": 2.0}),
        row(2, **{"kpi.a": True, "setting.n": None, "setting.how": 3, "setting.on": None, "setting.big": 2**70}),
    ]
    frames = []
    for i, parts in enumerate([[rows], [[each] for each in rows], [[each] for each in reversed(rows)]]):
        stored(folder / str(i), *parts)
        with Store(folder / str(i), SPECIFICATION) as store:
            store.compact()
        frames.append(read_rows(folder / str(i)))
        pd.testing.assert_frame_equal(frames[-1], frames[0])
    frame = frames[0]
    assert list(frame["kpi.a"])[1:] == [2.0, 1.0]
    assert np.isnan(frame["kpi.a"][0])
    assert frame["kpi.b"].dtype == float
    assert list(frame["setting.n"])[:2] == [1.0, 0.5]
    assert list(frame["setting.how"]) == ["auto", "2", "3"]
    assert list(frame["setting.on"]) == [True, None, None]
    assert frame["setting.big"][2] == str(2**70)


NUMBERS = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False)
COLUMNS = {"kpi.x": NUMBERS, "setting.x": NUMBERS | st.text(max_size=3)}


# Hypothesis makes its table of all characters at the first text, once on a machine: that draw is slow.
@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.data(), st.sampled_from(list(COLUMNS)))
def test_kinds_do_not_depend_on_parts(data, column):
    values = data.draw(st.lists(COLUMNS[column], min_size=1))
    require_same_in_parts(values, data.draw(st.integers(0, len(values))), column)


def test_kinds_of_whole_numbers_that_are_no_floats():
    require_same_in_parts([2**53 + 1, 0.0, False], 2, "setting.x")


def require_same_in_parts(values, cut, column):
    whole = common_kind(kind_of(value, column) for value in values)
    kinds = [common_kind(kind_of(value, column) for value in part) for part in (values[:cut], values[cut:])]
    assert common_kind(kinds) == whole
    at_once = [converted(value, whole) for value in values]
    first = [converted(value, kinds[0]) for value in values[:cut]] + [
        converted(value, kinds[1]) for value in values[cut:]
    ]
    assert [converted(value, whole) for value in first] == at_once


def test_columns_are_in_an_order_of_their_own():
    names = ["run.host", "status.OK", "setting.b", "kpi.z", "key", "setting.a", "kpi.y", "draw"]
    ordered = ["key", "draw", "setting.a", "setting.b", "kpi.y", "kpi.z", "status.OK", "run.host"]
    assert in_order(names) == in_order(reversed(names)) == ordered


def test_each_run_counts_once_preferably_done(folder):
    stored(
        folder, [row(0, "crashed", n=1), row(1, n=1)], [row(0, n=2), row(1, n=2)], [row(0, n=3), row(1, "timeout", n=3)]
    )
    with Store(folder, SPECIFICATION) as store:
        for _ in range(2):
            frame = store.rows()
            assert list(zip(frame["key"], frame["outcome"], frame["n"], strict=True)) in (
                [("0000", "done", 2), ("0001", "done", 1)],
                [("0001", "done", 1), ("0000", "done", 2)],
            )
            store.compact()
    assert files(folder) == ["000004.parquet"] or files(folder) == ["000005.parquet"]


def test_compaction_sorts_and_may_be_broken_off(folder, monkeypatch):
    stored(folder, [row(3), row(1)], [row(2)])
    removed = []

    def unlink(path, **_):
        removed.append(path)
        raise KeyboardInterrupt

    with Store(folder, SPECIFICATION) as store, monkeypatch.context() as patch:
        patch.setattr("pathlib.Path.unlink", unlink)
        with suppress(KeyboardInterrupt):
            store.compact()
        assert removed
    assert len(files(folder)) == 3
    assert set(read_rows(folder)["draw"]) == {1, 2, 3}
    with Store(folder, SPECIFICATION) as store:
        store.compact()
    assert list(read_rows(folder)["draw"]) == [1, 2, 3]
    assert len(files(folder)) == 1


@pytest.mark.parametrize("group", [1, 3, 100])
def test_compaction_has_each_row_once_in_order_and_few_in_memory(folder, monkeypatch, group):
    monkeypatch.setattr("rumo.campaigns.store.compaction.GROUP", group)
    rng = np.random.default_rng(0)
    for _ in range(3):
        parts = [
            [row(number, "done" if number % 3 else "raised", x=number if number % 2 else None, name=f"n{number}")]
            for number in rng.permutation(20).tolist()
        ]
        stored(folder, *parts, [row(number, y=[True, 1.5][number % 2]) for number in rng.permutation(30).tolist()])
        before = read_rows(folder).sort_values(["draw", "controller", "key"], ignore_index=True)
        with Store(folder, SPECIFICATION) as store:
            store.compact()
        assert len(files(folder)) == 1
        pd.testing.assert_frame_equal(read_rows(folder), before, check_exact=True)
    assert list(before["draw"]) == list(range(30))
    assert set(before["outcome"]) == {"done"}


WITHOUT = """
import sys
from rumo.campaigns.store import Store
for start in range(2):
    with Store(sys.argv[1], {}) as store:
        store.keys()
        settings = {"setting.on": True, "setting.name": "a", "setting.none": None}
        store.add({"key": str(start), "draw": start, "outcome": "done", "kpi.a": None, **settings})
        store.flush()
        store.records({"0"})
        store.compact()
sys.exit(" ".join({"pandas", "casadi"} & sys.modules.keys()) or None)
"""


def test_a_campaign_is_stored_without_pandas_and_casadi(folder):
    subprocess.run([sys.executable, "-c", WITHOUT, folder], check=True)
    assert len(read_rows(folder)) == 2


@pytest.mark.parametrize(
    ("kind", "values"),
    [
        ("string", ["a", None, "", "Grüße", "x" * 1000]),
        ("bool", [True, None, False] * 5),
        ("int64", [None, -(2**63), 2**63 - 1]),
        ("double", [0.1, None, np.inf, -0.0]),
        ("null", [None, None]),
        *((kind, []) for kind in ("string", "bool", "int64", "double", "null")),
    ],
)
def test_arrays_are_those_of_arrow(kind, values):
    array = array_of(values, kind)
    array.validate(full=True)
    assert array.equals(pa.array(values, type_of(kind)))


def test_texts_that_are_none_of_unicode_are_stored(folder):
    stored(folder, [row(0, error="\udcff")])
    assert read_rows(folder)["error"][0] == "\\udcff"


def test_what_is_compact_is_not_written_again(folder):
    stored(folder, [row(1)], [row(0)])
    for _ in range(2):
        with Store(folder, SPECIFICATION) as store:
            store.compact()
        assert files(folder) == ["000003.parquet"]
    stored(folder, [row(2)])
    with Store(folder, SPECIFICATION) as store:
        store.compact()
    assert files(folder) == ["000005.parquet"]


def test_parts_that_cannot_be_removed_are_in_nobodys_way(folder, monkeypatch):
    stored(folder, [row(1)], [row(0)])

    def unlink(path, **_):
        raise PermissionError(13, "Permission denied", str(path))

    with Store(folder, SPECIFICATION) as store, monkeypatch.context() as patch:
        patch.setattr("pathlib.Path.unlink", unlink)
        store.compact()
    assert list(read_rows(folder)["draw"]) == [1, 0]
    with Store(folder, SPECIFICATION) as store:
        store.compact()
    assert files(folder) == ["000004.parquet"]


def test_logs_are_files_of_their_own(folder):
    with Store(folder, SPECIFICATION) as store:
        store.add(row(7, log=b"a log"))
        assert (folder / "logs" / "0007.nc").read_bytes() == b"a log"
        store.flush()
        assert "log" not in store.rows()


def test_of_many_runs_not_all_logs_are_kept(folder, monkeypatch):
    monkeypatch.setattr("rumo.campaigns.store.store.MOST_LOGS", 2)
    for first in (0, 3):  # also when it is started again
        with Store(folder, SPECIFICATION) as store:
            for number in range(first, first + 3):
                store.add(row(number, log=b"a log"))
            store.flush()
    assert sorted(path.stem for path in (folder / "logs").glob("*.nc")) == ["0000", "0001"]


def test_an_empty_campaign_has_no_rows(folder):
    with Store(folder, SPECIFICATION) as store:
        assert store.keys() == set()
        store.compact()
        assert not len(store.rows())
    assert read_head(folder)["specification"] == SPECIFICATION


def torn(folder):
    path = folder / "rows" / "000001.parquet"
    path.write_bytes(path.read_bytes()[:-20])
    return path


def foreign(folder):
    path = folder / "rows" / "000002.parquet"
    pd.DataFrame({"a": [1]}).to_parquet(path)
    return path


def other(folder):
    path = folder / "rows" / "notes.txt"
    path.write_text("mine")
    return path


@pytest.mark.parametrize(
    ("spoil", "what"),
    [(torn, "a file that is torn"), (foreign, "no column 'key'"), (other, "something that no campaign writes")],
)
def test_a_file_of_others_is_named(folder, spoil, what):
    stored(folder, [row(0)])
    path = spoil(folder)
    with pytest.raises(FileError, match=what) as caught:
        read_rows(folder)
    assert caught.value.file == str(path)
    with pytest.raises(FileError, match=what), Store(folder, SPECIFICATION) as store:
        store.keys()


def test_what_a_killed_writer_has_left_is_removed(folder):
    stored(folder, [row(0)])
    left = folder / "rows" / ".0123456789abcdef.parquet"
    left.write_bytes(b"half")
    assert len(read_rows(folder)) == 1
    stored(folder)
    assert not left.exists()


def test_what_may_change_is_what_the_folder_says_from_then_on(folder):
    for runs in (3, 5):
        with Store(folder, {**SPECIFICATION, "runs": runs}, {"name": "a"}) as store:
            store.describe()
            assert read_head(folder)["specification"]["runs"] == runs
    with pytest.raises(rumo.ArgumentError, match='another campaign: name was "a", is "b", expected'):
        Store(folder, SPECIFICATION, {"name": "b"})


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"rumo": "0.0.1"}, "of Rumo 0.0.1, expected rows of Rumo"),
        (
            {"hash": "0", "identity": {"name": "b", "runs": 3}},
            'of another campaign: name was "b", is "a", expected',
        ),
        ({"format": 2}, "of format 2, expected format 1"),
    ],
)
def test_a_folder_of_something_else_is_refused(folder, change, what):
    stored(folder, [row(0)])
    head = folder / "campaign.json"
    head.write_text(json.dumps(json.loads(head.read_text()) | change))
    with pytest.raises(rumo.ArgumentError, match=what):
        Store(folder, SPECIFICATION)


@pytest.mark.parametrize("text", ["{", "[]", "{}", None])
def test_a_damaged_head_is_refused(folder, text):
    stored(folder, [row(0)])
    head = folder / "campaign.json"
    head.unlink() if text is None else head.write_text(text)
    with pytest.raises(FileError, match=r"campaign.json"):
        Store(folder, SPECIFICATION)


def test_a_folder_without_a_campaign(folder):
    with pytest.raises(rumo.ArgumentError, match=r"campaign: got .*, expected the folder of a campaign"):
        read_rows(folder)


def test_a_place_that_is_a_file(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(rumo.ArgumentError, match=r"output: got .*file' \(.*\), expected a folder"):
        Store(tmp_path / "file", SPECIFICATION)


def hold(folder, ready, end):
    with Store(folder, SPECIFICATION):
        ready.set()
        end.wait()


def test_two_at_once_are_refused_and_a_dead_one_is_not_in_the_way(folder, monkeypatch):
    monkeypatch.setattr("rumo.campaigns.store.alone.PATIENCE", 0.1)
    context = multiprocessing.get_context("spawn")
    ready, end = context.Event(), context.Event()
    other = context.Process(target=hold, args=(folder, ready, end))
    other.start()
    try:
        assert ready.wait(60)
        with pytest.raises(rumo.ArgumentError, match=f"in use by process {other.pid} on "):
            Store(folder, SPECIFICATION)
        read_rows(folder)
    finally:
        other.kill()
        other.join()
    assert (folder / LOCK).exists()
    with Store(folder, SPECIFICATION):
        pass
    assert not (folder / LOCK).exists()


@pytest.fixture
def full_disk(monkeypatch):
    """A disk that can be full."""
    state = {"full": True}
    write = rumo.campaigns.store.parts.write_whole

    def write_whole(path, writer, **options):
        def half(place):
            writer(place)
            if state["full"]:
                place.write_bytes(place.read_bytes()[:10])
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        return write(path, half, **options)

    for module in ("parts", "compaction"):
        monkeypatch.setattr(f"rumo.campaigns.store.{module}.write_whole", write_whole)
    return state


def test_a_full_disk_loses_nothing_that_is_stored(folder, full_disk):
    full_disk["full"] = False
    stored(folder, [row(0)])
    full_disk["full"] = True
    with Store(folder, SPECIFICATION) as store:
        store.add(row(1))
        with pytest.raises(CampaignError, match=r"No space left on device. 0 rows .* stored, 1 row not yet. Make room"):
            store.flush()
        assert files(folder) == ["000001.parquet"]
        full_disk["full"] = False
        store.flush()
        full_disk["full"] = True
        with pytest.raises(CampaignError, match=r"No space left on device. 1 row of this start is stored. Make room"):
            store.compact()
    assert len(read_rows(folder)) == 2


@pytest.mark.skipif(os.name != "posix", reason="Windows has no limits of this kind")
def test_a_limit_of_file_sizes_is_like_a_full_disk(folder):
    import resource
    import signal

    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    with Store(folder, SPECIFICATION) as store:
        store.add(row(0, text="x" * 1000))
        try:
            resource.setrlimit(resource.RLIMIT_FSIZE, (500, limits[1]))
            with pytest.raises(CampaignError, match="cannot be written to"):
                store.flush()
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
            signal.signal(signal.SIGXFSZ, before)
        assert files(folder) == []
        store.flush()
        assert len(store.rows()) == 1
