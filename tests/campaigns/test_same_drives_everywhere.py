"""The example's drives give the same rows to the last bit, one by one and on two clusters."""

from pathlib import Path

import pandas as pd
import pytest

import rumo

pytest.importorskip("distributed")
pytest.importorskip("pyarrow")
pytestmark = pytest.mark.slow
EXAMPLE = Path(__file__).parents[2] / "examples" / "campaign.toml"
DRAWS = 6


@pytest.fixture
def file(tmp_path):
    text = EXAMPLE.read_text(encoding="utf-8")
    assert "runs = 64 " in text
    path = tmp_path / "campaign.toml"
    path.write_text(text.replace("runs = 64 ", f"runs = {DRAWS} "), encoding="utf-8")
    return path


def test_same_rows(cluster, file, tmp_path):
    cluster.start(2)
    frames = [
        rumo.campaign(file, tmp_path / name, **options)
        for name, options in {
            "serial": {"serial": True},
            "embedded": {"jobs": 2},
            "other": {"scheduler": cluster.address},
        }.items()
    ]
    lasting = [name for name in frames[0].columns if not name.startswith("run.") and name != "attempts"]
    serial, *others = (frame.sort_values("key", ignore_index=True)[lasting] for frame in frames)
    assert len(serial) == 2 * DRAWS
    assert set(serial["outcome"]) == {"done"}
    for other in others:
        pd.testing.assert_frame_equal(other, serial, check_exact=True)
        numbers = serial.select_dtypes("number").columns
        assert other[numbers].to_numpy().tobytes() == serial[numbers].to_numpy().tobytes()  # also NaN, and signs of 0
