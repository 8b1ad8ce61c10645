"""From a task to its row: pure, the same in another process, and honest about runs that fail."""

import json
import subprocess
import sys
from collections import Counter

import numpy as np
import pytest

import rumo
from rumo.campaigns.judging.columns import MADE_WITH
from rumo.campaigns.specification import Campaign
from rumo.campaigns.work import WORK, prepare, run
from rumo.scenarios import Recipe
from rumo.simulation import load
from rumo.simulation.variables import TIMES
from rumo.studies.base import shared_controller

PAPER = Recipe("paper", {"duration": 1.0, "backend": "portable"})
AGAIN = """
import json, sys
from rumo.campaigns.work import load, run
common, task = json.loads(sys.stdin.read())
load()
before = {name.partition(".")[0] for name in sys.modules}
log = run(common, task)["log"]
assert not {"pandas", "xarray", "h5netcdf", "h5py", "scipy"} - before, before
sys.stdout.buffer.write(log)
"""


def rows_of(campaign):
    return [run(campaign.common, task) for task in campaign.tasks]


def same(row):
    return {name: value for name, value in row.items() if not name.startswith("run.") and name != "log"}


@pytest.fixture(scope="module")
def campaign():
    return Campaign(PAPER, {"mass": [180.0, 220.0]}, controllers=("rti", "ltv"), logs="all", seed=1)


@pytest.fixture(scope="module")
def rows(campaign):
    return rows_of(campaign)


def opened(log, folder):
    (folder / "log.nc").write_bytes(log)
    return load(folder / "log.nc")


def test_a_row_says_what_came_of_a_run(campaign, rows, tmp_path):
    row = rows[0]
    log = opened(row["log"], tmp_path)
    assert (row["outcome"], row["error"], row["ended"]) == ("done", None, None)
    error = np.hypot(*(log.plant.sel(plant_state=n) - log.reference.sel(output=n) for n in ("p_x", "p_y")))
    assert row["kpi.tracking_error_rms_m"] == pytest.approx(np.sqrt(np.mean(error.to_numpy() ** 2)), rel=1e-12)
    assert row["kpi.lap_time_s"] is None
    assert row["kpi.friction_use_max.fl"] > 0.0
    moves = np.abs(np.diff(log.applied.sel(input="torque"))).sum() / (0.04 * (log.sizes["time"] - 1))
    assert row["kpi.input_variation_per_s.torque"] == pytest.approx(moves)
    statuses = {name: count for name, count in row.items() if name.startswith("status.")}
    assert statuses == {f"status.{name}": count for name, count in Counter(log.status.values.tolist()).items()}
    assert sum(statuses.values()) == 25
    assert not any("step_time" in name or "deadline" in name for name in same(row))
    assert row["run.step_time_p50_us"] <= row["run.step_time_p99_us"] <= row["run.step_time_max_us"]
    assert row["run.backend"] == "portable"
    assert {f"run.{name}" for name in MADE_WITH} <= row.keys()
    assert all(type(value) in (type(None), bool, int, float, str, bytes) for value in row.values())


def test_draws_differ_and_are_paired(rows):
    errors = [row["kpi.tracking_error_rms_m"] for row in rows]
    assert len(set(errors)) == 4
    assert errors[0] == pytest.approx(errors[1], rel=0.1)


def test_a_row_does_not_depend_on_what_was_run_before(campaign, rows):
    first, _, third, _ = campaign.tasks
    assert [same(run(campaign.common, task)) for task in (third, first)] == [same(rows[2]), same(rows[0])]


def test_another_process_makes_the_same_log_bit_for_bit(campaign, rows, tmp_path):
    prepare(campaign.common)
    task = list(campaign.tasks)[2]
    sent = json.dumps([campaign.common, task]).encode()
    answer = subprocess.run([sys.executable, "-c", AGAIN], input=sent, capture_output=True, check=True)
    found, expected = opened(answer.stdout, tmp_path), opened(rows[2]["log"], tmp_path)
    assert found.drop_vars(TIMES).equals(expected.drop_vars(TIMES))
    assert found.attrs == expected.attrs


def test_logs_of_those_that_fail_are_kept():
    criteria = {"close": {"kpi": "tracking_error_rms_m", "at_most": 1.0}}
    kept, unasked = {}, []
    for logs in ("failed", "all", "none"):
        campaign = Campaign(
            PAPER,
            {"initial_error": [0.0, 3.0], "seed": [0]},
            criteria=criteria,
            logs=logs,
        )
        rows = rows_of(campaign)
        kept[logs] = ["log" in row for row in rows]
        again = [run(campaign.common, {**task, "log": False}) for task in campaign.tasks]
        assert [same(row) for row in again] == [same(row) for row in rows]
        unasked += ["log" in row for row in again]
    assert kept == {"failed": [False, True], "all": [True, True], "none": [False, False]}
    assert not any(unasked)


def test_only_figures_that_are_wanted_are_there():
    campaign = Campaign(PAPER, kpis=("fallbacks",), criteria={"close": {"kpi": "tracking_error_rms_m", "at_most": 1}})
    (row,) = rows_of(campaign)
    assert {name for name in row if name.startswith("kpi.")} == {"kpi.fallbacks", "kpi.tracking_error_rms_m"}


def test_a_car_that_is_lost_is_done():
    lost = Recipe("track", {"track": "oval", "x.psi": 1.5, "backend": "portable"})
    (row,) = rows_of(Campaign(lost, kpis=("distance",), criteria={"far": {"kpi": "distance_m", "at_least": 400.0}}))
    assert row["outcome"] == "done"
    assert row["ended"].startswith("Lost ")
    assert row["kpi.distance_m"] < 400.0
    assert "log" in row


def test_a_run_that_raises_has_its_log_until_then(tmp_path):
    broken = PAPER.with_settings({"x.v_x": 1e200})
    with pytest.raises(rumo.PlantError) as caught:
        run(Campaign(broken).common, {"controller": "rti", "settings": {}})
    row = caught.value.row
    assert row["run.backend"] == "portable"
    assert row["run.wall_time_s"] > 0.0
    assert opened(row["log"], tmp_path).attrs["complete"] == "no"
    assert "outcome" not in row


def test_ones_own_runs_need_no_scenario(tmp_path):
    (tmp_path / "own.py").write_text(
        "from rumo.scenarios import Recipe\n"
        "class Own:\n    def run(self, *, progress=None):\n"
        "        return Recipe('paper', {'duration': 1.0, 'backend': 'portable'}).run().run()\n"
        "def make(*, controller):\n    return Own()\n"
    )
    recipe = Recipe(f"{tmp_path / 'own.py'}:make")
    row = run(Campaign(recipe, kpis=("fallbacks",)).common, {"controller": "rti", "settings": {}})
    assert (row["kpi.fallbacks"], row["run.backend"]) == (0, None)


def test_preparing_makes_the_controllers(campaign):
    prepare(campaign.common)
    made = shared_controller(PAPER.run())
    assert shared_controller(PAPER.with_settings({"mass": 230.0}).run()) is made


def test_what_a_base_needs_may_vary(tmp_path):
    (tmp_path / "own.py").write_text(
        "from rumo.scenarios import Recipe\n"
        "def make(*, speed):\n"
        "    return Recipe('paper', {'speed': speed, 'duration': 0.2, 'backend': 'portable'}).run()\n"
    )
    campaign = Campaign(Recipe(f"{tmp_path / 'own.py'}:make"), {"speed": [6.0, 8.0]}, kpis=("fallbacks",))
    campaign.rehearse()
    prepare(campaign.common)
    assert [row["kpi.fallbacks"] for row in rows_of(campaign)] == [0, 0]


def test_engines_know_it_by_name():
    module, _, name = WORK.partition(":")
    assert getattr(sys.modules[module], name) is run
