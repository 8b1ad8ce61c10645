"""What a campaign is: paired runs with keys, and an error before any work for what could not be driven."""

import json
from itertools import islice
from pathlib import Path

import pytest

import rumo
from rumo.campaigns.judging.criteria import Criterion
from rumo.campaigns.specification import Campaign
from rumo.campaigns.specification.distributions import Normal, Uniform
from rumo.scenarios import Recipe
from rumo.studies.kpis import KPIS

PAPER = Recipe("paper", {"duration": 1.0, "backend": "portable"})
TEXT = """
[campaign]
runs = 30
controllers = ["rti", "ltv"]
seed = 2
timeout = 60.0
kpis = ["tracking_error_rms"]

[scenario]
base = "paper"
duration = 1.0
"problem.weights.p_y" = 2.0

[vary]
seed = { from = 0, to = 4 }
speed = [6.0, 8.0]
mass = { distribution = "normal", mean = 200.0, std = 20.0 }
plant.mu = { distribution = "uniform", low = 0.7, high = 1.1 }

[criteria]
close = { kpi = "tracking_error_rms_m", at_most = 0.3 }

[report]
heat_map = ["speed", "plant.mu"]
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "campaign.toml"
    path.write_text(TEXT)
    return path


def test_a_file_says_all_of_it(file):
    campaign = Campaign.from_toml(file)
    assert (campaign.runs, campaign.controllers, campaign.seed, campaign.timeout) == (30, ("rti", "ltv"), 2, 60.0)
    assert campaign.recipe == Recipe("paper", {"duration": 1.0, "problem.weights.p_y": 2.0})
    assert campaign.kpis == ("tracking_error_rms",)
    assert campaign.criteria["close"] == Criterion("close", "tracking_error_rms_m", at_most=0.3)
    assert campaign.vary["mass"] == Normal(200.0, 20.0)
    assert campaign.varied == ("seed", "speed", "mass", "plant.mu")
    assert campaign.report == {"heat_map": ["speed", "plant.mu"]}
    again = Campaign.of(json.loads(json.dumps(campaign.plain)))
    assert again.plain == campaign.plain
    assert list(again.tasks) == list(campaign.tasks)


def test_tasks_are_paired(file):
    campaign = Campaign.from_toml(file)
    tasks = list(campaign.tasks)
    assert len(tasks) == len(campaign.tasks) == 60
    assert json.loads(json.dumps(tasks)) == tasks
    assert len({task["key"] for task in tasks}) == 60
    for first, second in zip(tasks[::2], tasks[1::2], strict=True):
        assert (first["draw"], first["settings"]) == (second["draw"], second["settings"])
        assert (first["controller"], second["controller"]) == ("rti", "ltv")
    points = {(task["settings"]["seed"], task["settings"]["speed"]) for task in tasks}
    assert points == {(seed, speed) for seed in range(5) for speed in (6.0, 8.0)}


def test_each_draw_has_a_seed_of_its_own_where_none_is_said():
    campaign = Campaign(PAPER, {"mass": Uniform(180.0, 220.0)}, runs=3, seed=2)
    assert [task["settings"]["seed"] for task in campaign.tasks] == [2_000_000, 2_000_001, 2_000_002]
    assert campaign.varied == ("mass", "seed")
    fixed = Campaign(PAPER.with_settings({"seed": 4}), {"mass": Uniform(180.0, 220.0)}, runs=3)
    assert all("seed" not in task["settings"] for task in fixed.tasks)


def test_runs_are_the_points_of_the_grids_if_not_given():
    assert Campaign(PAPER, {"speed": [6.0, 8.0], "seed": range(5)}).runs == 10
    assert Campaign(PAPER).runs == 1
    assert Campaign(PAPER, {"speed": [6.0, 8.0]}, runs=5).runs == 5


def test_a_hundred_thousand_draws_are_made_one_by_one():
    campaign = Campaign(PAPER, {"mass": Uniform(180.0, 220.0), "speed": [6.0, 8.0]}, runs=100_000)
    assert len(list(islice(campaign.tasks, 3))) == 3
    assert len(campaign.tasks) == 100_000


def test_keys_are_of_all_that_decides_a_row(tmp_path, monkeypatch):
    def key(recipe=PAPER, controller="rti", mass=200.0, **settings):
        return Campaign(recipe, {"mass": [mass]}, controllers=(controller,), **settings).task(0, controller)["key"]

    first = key()
    assert len(first) == 16
    assert key() == first
    assert key(timeout=3.0, logs="all", kpis=tuple(reversed(KPIS))) == first
    assert key(criteria={"a": {"kpi": "fallbacks", "at_most": 0}}) == first
    others = [
        key(mass=201.0),
        key(controller="ltv"),
        key(seed=1),
        key(kpis=("fallbacks",)),
        key(PAPER.with_settings({"speed": 9.0})),
    ]
    monkeypatch.setattr("rumo.campaigns.specification.keys.__version__", "0.0")
    assert len({first, *others, key()}) == 7


def test_a_task_is_found_by_its_key():
    campaign = Campaign(PAPER, {"mass": Uniform(180.0, 220.0)}, runs=20)
    task = list(campaign.tasks)[7]
    assert campaign.find(task["key"]) == campaign.find(task["key"][:8]) == task
    for key, said in (("xyz", "the beginning of 0 of 20 keys"), ("", "beginning of 0")):
        with pytest.raises(rumo.ArgumentError, match=said):
            campaign.find(key)


def test_figures_are_known_by_name_or_key():
    campaign = Campaign(
        PAPER,
        kpis=("lap_time_s", "fallbacks"),
        criteria={
            "calm": {"kpi": "input_variation_per_s.torque", "at_most": 5.0},
            "close": {"kpi": "tracking_error_rms", "at_most": 0.3},
            "quick": {"kpi": "step_time_p99_us", "at_most": 1e4},
            "punctual": Criterion("punctual", "deadline_misses", at_most=0),
        },
    )
    assert campaign.kpis[:5] == ("lap_time", "fallbacks", "input_variation", "tracking_error_rms", "step_time")
    assert campaign.criteria["close"].kpi == "tracking_error_rms_m"
    assert campaign.criteria["calm"].kpi == "input_variation_per_s.torque"


HOSTILE = [
    ("runs = 30", "runs = 3", r"line 3: runs: got 3, expected at least 10, one for each point of the grids"),
    ("runs = 30", "runs = 0", r"line 3: runs: got 0"),
    ("runs = 30", "runs = 30.5", r"line 3: runs: got 30.5"),
    ("runs = 30", "runs = 1000000000", r"line 3: runs: got 1000000000, expected a whole number of at most"),
    ("runs = 30", "", r"runs: got nothing, expected a number of draws"),
    ("runs = 30", "runz = 30", r"line 3: campaign\.runz: got 'runz', .*Did you mean 'runs'"),
    ('"rti", "ltv"', '"rti", "lqr"', r"line 4: controllers: got 'lqr', expected one of rti, nlp, ltv"),
    ('"rti", "ltv"', '"rti", "rti"', r"line 4: controllers: got \['rti', 'rti'\], expected each of them once"),
    ('["rti", "ltv"]', '"rti"', r"line 4: campaign\.controllers: got 'rti', expected a list"),
    ("seed = 2", "seed = -2", r"line 5: seed: got -2"),
    ("seed = 2", 'sampling = "halton"', r"line 5: sampling: got 'halton', expected one of sobol"),
    ("seed = 2", 'logs = "some"', r"line 5: logs: got 'some', expected one of failed"),
    ("timeout = 60.0", "timeout = nan", r"line 6: timeout: got nan"),
    (
        '"tracking_error_rms"',
        '"tracking_rms"',
        r"line 7: kpis: got 'tracking_rms', expected one of 34 figures of merit .*KPIS.*mean 'tracking_error_rms'",
    ),
    ('"paper"', '"papers"', r"line 10: scenario\.base: got 'papers', .*Did you mean 'paper'"),
    ('base = "paper"', "", r"line 9: scenario\.base: got nothing"),
    ("[scenario]", "[[scenario]]", r"line 9: scenario: got \[.*expected a table: \[scenario\]"),
    ('"paper"', '"own.py:make"', r"line 10: scenario\.base: got .*own.py' \(No such file"),
    ("duration = 1.0", "duration = 0.01", r"line 11: scenario\.duration: got 0.01 s, expected at least one sample"),
    ("duration = 1.0", "duratoin = 1.0", r"line 11: scenario\.duratoin: got 'duratoin'.*Did you mean 'duration'"),
    ("duration = 1.0", "filter_cutoff = 100.0", r"scenario: cutoff: got 100.0 Hz, expected a frequency between"),
    ("duration = 1.0", '"estimator.cutoff" = 99.0', r"line 11: scenario\.estimator\.cutoff: got 99.0 .*a frequency"),
    ("duration = 1.0", 'controller = "ltv"', r"line 11: scenario\.controller: got something"),
    (
        "duration = 1.0",
        '"settings.sqp_iterations" = 2',
        r"line 11: scenario\.settings\.sqp_iterations: got 'sqp_it.*gate, qp",
    ),
    ("duration = 1.0", '"sensors.noise.p_q" = 0.1', r"line 11: scenario\.sensors\.noise\.p_q: got 0.1 .*'p_q'"),
    ("weights.p_y", "weights.p_z", r"line 12: scenario\.problem\.weights\.p_z: got 'p_z', expected one of p_x, p_y"),
    ('p_y" = 2.0', 'p_y" = -2.0', r"line 12: scenario\.problem\.weights\.p_y: got weight -2.0"),
    (
        "[vary]",
        "[scenario.problem.weights]\np_y = 3.0\n[vary]",
        r"line 12: scenario\.problem\.weights\.p_y: got two va",
    ),
    ("[vary]", '[vary]\n"plant.mu" = [1.0, 2.0]', r"line 15: vary\.plant\.mu: got two values, expected one"),
    ("[vary]", '[vary]\n"" = [1.0, 2.0]', r"line 14: vary: got the name '', expected a name that is not empty"),
    ("to = 4", "to = -4", r"line 15: vary\.seed\.to: got -4"),
    ("[6.0, 8.0]", "[]", r"line 16: vary\.speed\.values: got \[\]"),
    ("[6.0, 8.0]", "7.0", r"line 16: vary\.speed: got 7.0, .*belongs to \[scenario\]"),
    ("[6.0, 8.0]", "[6.0, -8.0]", r"line 16: vary\.speed: got -8.0, expected a number above 0"),
    ("[6.0, 8.0]", '[6.0, "fast"]', r"line 16: vary\.speed: got 'fast', expected a number above 0"),
    ("std = 20.0", "std = 900.0", r"line 17: vary\.mass: got -.*expected a number above 0. Give the distribution ends"),
    ("std = 20.0", "std = 20.0, low = -1.0", r"line 17: vary\.mass: got -1.0, expected a number above 0"),
    (", std = 20.0", "", r"line 17: vary\.mass\.std: got nothing"),
    ("speed = [6.0", "x.p_z = [6.0", r"report\.heat_map: got 'speed', expected one of seed, x\.p_z"),
    ("mass = {", "plant.muu = {", r"line 17: vary\.plant\.muu: got 'muu', .*Did you mean 'mu'"),
    ("low = 0.7", "low = -0.7", r"line 18: vary\.plant\.mu: got -0.7, expected a number of at least 0"),
    ("low = 0.7", "low = 1.7", r"line 18: vary\.plant\.mu\.high: got 1.1"),
    ('"uniform"', '"unifrom"', r"line 18: vary\.plant\.mu\.distribution: got 'unifrom'"),
    ("tracking_error_rms_m", "tracking_error", r"line 21: criteria\.close\.kpi: got 'tracking_error'"),
    ("at_most = 0.3", 'at_most = "half"', r"line 21: criteria\.close\.at_most: got 'half', expected a finite number"),
    (", at_most = 0.3", "", r"line 21: criteria\.close: got no limit"),
    ("tracking_error_rms_m", "step_time_us.p99", r"line 21: criteria\.close\.kpi: .*step_time_p99_us"),
    ("close = {", '"" = {', r"line 20: criteria: got the name '', expected a name that is not empty"),
    ("close = {", '" " = {', r"line 20: criteria: got the name ' '"),
    ("[criteria]", "[criterion]", r"line 20: criterion: got 'criterion', .*Did you mean 'criteria'"),
    ('"plant.mu"]', '"mu"]', r"line 24: report\.heat_map: got 'mu', expected one of seed, speed"),
    ('["speed", "plant.mu"]', '["speed"]', r"line 24: report\.heat_map: .*two settings that vary"),
    ('"plant.mu"]', '"speed"]', r"line 24: report\.heat_map: got 'speed' twice, expected two settings that vary"),
    ("heat_map", "heatmap", r"line 24: report\.heatmap: got 'heatmap', expected one of heat_map"),
    ("[campaign]", "[campaign", r"campaign\.toml, line 2: got .*expected a TOML file"),
    ("[campaign]", "campaign = 3\n[c]", r"got 'c', expected one of campaign|campaign: got 3"),
]


@pytest.mark.parametrize(("right", "wrong", "said"), HOSTILE, ids=[wrong for _, wrong, _ in HOSTILE])
def test_what_could_not_be_driven_is_an_error_before_any_drive(file, right, wrong, said):
    assert right in TEXT
    file.write_text(TEXT.replace(right, wrong))
    with pytest.raises(rumo.ArgumentError, match=said) as caught:
        Campaign.from_toml(file)
    assert str(file) in str(caught.value)


def test_ones_own_file_that_raises_is_named(file):
    own = file.parent / "own.py"
    own.write_text("def make(*, speed=8.0):\n    return {}[speed]")
    file.write_text(TEXT.replace('"paper"', '"own.py:make"').replace("duration = 1.0", "").replace("mass", '"x.p_y"'))
    with pytest.raises(
        rumo.ArgumentError, match=r"scenario: got these settings, with which .*own\.py:make raises KeyErr"
    ):
        Campaign.from_toml(file)


def test_a_controller_that_could_not_take_a_step_is_an_error():
    tank = Campaign(Recipe("reactor", {"backend": "portable"}), {"seed": [0, 1]}, controllers=("rti", "ltv"))
    with pytest.raises(rumo.ArgumentError, match=r"^scenario: reference: got no values for .* LinearTimeVarying"):
        tank.rehearse()


def test_files_are_relative_to_the_campaigns(file):
    (file.parent / "own.py").write_text(
        "from rumo.scenarios import Recipe\ndef make(*, speed, mass):\n"
        "    return Recipe('paper', {'speed': speed, 'mass': mass, 'duration': 1.0}).run()"
    )
    file.write_text(TEXT.replace('"paper"', '"own.py:make"').replace("duration = 1.0", ""))
    campaign = Campaign.from_toml(file)
    assert Path(campaign.recipe.base.rpartition(":")[0]).is_absolute()


def test_from_python():
    for arguments, said in (
        ({"vary": {"speed": "fast"}}, r"vary\.speed: got 'fast', expected a list of values"),
        ({"vary": {"speed": []}}, r"vary\.speed: got \[\]"),
        ({"vary": {"controller": ["rti"]}}, r"vary\.controller"),
        ({"vary": {"seed": range(5)}, "runs": 9}, r"runs: got 9, expected 5, one for each point of the grids"),
        ({"criteria": {"a": 3}}, r"criteria\.a: got 3"),
        ({"controllers": ()}, "controllers: got none"),
    ):
        with pytest.raises(rumo.ArgumentError, match=said):
            Campaign(PAPER, **arguments)
    with pytest.raises(rumo.ArgumentError, match=r"vary\.speed: got -1.0, expected a number above 0"):
        Campaign(PAPER, {"speed": [8.0, -1.0]}).rehearse()
