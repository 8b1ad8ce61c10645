"""Runs to begin with: documented, what studies drive, and made once for all that share their expensive parts."""

from contextlib import closing
from dataclasses import replace
from types import NoneType

import numpy as np
import pytest

import rumo
from rumo.scenarios import BASES, Recipe, arguments_of, changed, settings_of
from rumo.simulation import ClosedLoop
from rumo.studies import PaperStudy
from rumo.studies.drive import Drive
from rumo.studies.kpis import driven, kpis


def scenario_of(run):
    return getattr(run, "scenario", run)


@pytest.fixture(params=BASES)
def base(request):
    return request.param


def test_arguments_say_what_they_are(base):
    for name, argument in arguments_of(BASES[base]).items():
        assert argument.meaning.endswith("."), name
        assert argument.kinds, name
        assert not argument.needed, name
        assert argument.checked(argument.default, name) == argument.default
        assert argument.unit, name


def test_a_run_begins(base):
    run = changed(BASES[base](), {"backend": "portable"})
    with closing(ClosedLoop(scenario_of(run)).moments()) as moments:
        assert next(moments).index == 0


def test_names_are_of_plain_values_and_lead_back(base):
    run = BASES[base]()
    found = settings_of(run)
    assert all(isinstance(value, bool | int | float | str | list | NoneType) for value in found.values())
    again = changed(run, {name: value for name, value in found.items() if value is not None})
    assert settings_of(again) == found
    assert scenario_of(again).problem is scenario_of(run).problem


SHARED = {
    "paper": {"mass": 210.0, "seed": 5, "wind_std": 0.5, "noise_scale": 0.0, "sensors.noise.p_x": 0.1},
    "track": {"plant.m": 1000.0, "seed": 5, "sensors.noise.p_x": 0.1, "disturbances.wind_speed.mean": 4.0},
    "reactor": {"product": 1.0, "seed": 5, "plant.feed_temperature": 100.0, "temperature_noise": 0.0},
}


def test_expensive_parts_are_made_once(base):
    first, second = (scenario_of(Recipe(base, settings).run()) for settings in ({}, SHARED[base]))
    assert second.problem is first.problem
    assert second.plant is first.plant


def test_one_structure_serves_all_paths():
    first, second = (Recipe("paper", {"speed": speed, "penalty": price}).run() for speed, price in ((8, 1), (11, 3)))
    assert second.problem.rows is first.problem.rows
    assert second.problem.numbers.ranges[0] > first.problem.numbers.ranges[0]
    assert settings_of(second)["problem.penalties.friction_rear.l1"] == 3.0


def test_paper_is_the_study():
    """Numbers of its car are parameters, so that the last bits differ, and what the integrator makes of them."""
    study = PaperStudy(duration=1.0)
    ours = Recipe("paper", {"duration": 1.0, "backend": "portable"}).run()
    theirs = replace(study.scenario("rti", study.problem(), study.plant()), backend="portable")
    found, expected = ours.run(), theirs.run()
    np.testing.assert_allclose(found.plant, expected.plant, rtol=1e-6, atol=1e-6)
    assert (
        settings_of(ours).items()
        >= {name: value for name, value in settings_of(theirs).items() if "plant" not in name}.items()
    )


def test_mass_and_friction_are_the_plants():
    run = Recipe("paper", {"mass": 260.0, "inertia": 180.0, "friction": 0.7}).run()
    found = settings_of(run)
    assert (found["plant.m"], found["plant.I"], found["plant.mu"]) == (260.0, 180.0, 0.7)
    assert found["problem.parameters.mu"] == 0.9


def test_track_is_the_drive():
    ours = Recipe("track", {"track": "oval", "distance": 30.0, "seed": 3, "backend": "portable"}).run()
    theirs = Drive("oval", distance=30.0, seed=3, backend="portable").drive
    found, expected = ours.run(), theirs.run()
    assert found.attrs["outcome"] == "finished"
    np.testing.assert_allclose(found.plant, expected.plant, rtol=1e-6, atol=1e-6)
    wanted = ("lateral_deviation_max", "friction_use_max", "profile_time", "least_room")
    figures = kpis(driven(ours, found), wanted)
    assert figures["least_room_m"] == pytest.approx(kpis(driven(theirs, expected), wanted)["least_room_m"], abs=1e-6)
    assert None not in figures.values()


def test_a_reactor_is_kept_within_its_limits():
    log = Recipe("reactor", {"duration": 1800.0, "backend": "portable", "temperature_noise": 0.0}).run().run()
    assert float(log.plant.sel(plant_state="temperature").max()) < 114.6
    assert float(log.plant.sel(plant_state="c_b")[-1]) == pytest.approx(0.9, abs=0.01)


def test_a_track_file_that_changes_is_read_again(tmp_path):
    file = tmp_path / "round.csv"
    angle = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)

    def write(radius):
        rows = [f"{radius * np.cos(a)},{radius * np.sin(a)},5,5" for a in angle]
        file.write_text("# x_m,y_m,w_tr_right_m,w_tr_left_m\n" + "\n".join(rows))
        return Recipe("track", {"track": str(file)})

    lengths = []
    identities = []
    for radius in (50.0, 60.0):
        recipe = write(radius)
        lengths.append(recipe.run().path.length)
        identities.append(recipe.identity)
    assert lengths == pytest.approx([100.0 * np.pi, 120.0 * np.pi], rel=1e-3)
    assert identities[0] != identities[1]
    assert str(tmp_path) not in str(identities)


def test_arguments_are_checked_by_their_range():
    for settings, said in (
        ({"track": "moon"}, "track: got 'moon', expected one of oval, club"),
        ({"grip": 0.0}, "grip: got 0.0, expected a number above 0"),
        ({"laps": 1.5}, "laps: got 1.5, expected a whole number of at least 1"),
        ({"estimator": "kalman"}, "estimator: got 'kalman', expected one of ekf"),
        ({"mu": float("nan")}, "mu: got nan, expected a number above 0, or none"),
        ({"vehicle": 3}, "vehicle: got 3, expected a text, or none"),
    ):
        with pytest.raises(rumo.ArgumentError, match=said):
            Recipe("track", settings).run()


def test_a_patch_lies_on_the_path_of_a_track_also_across_its_line():
    bare = BASES["track"]()
    length = bare.path.length
    across = BASES["track"](patch_at=length - 5.0, patch_length=12.0, patch_friction=0.4).scenario.disturbances["mu"]
    own = bare.scenario.plant.default_parameters[list(bare.scenario.plant.parameters).index("mu")]
    assert [across.at(s) for s in (length - 6.0, length - 4.0, 0.0, 6.9, 7.1)] == [own, 0.4, 0.4, 0.4, own]
    assert "mu" not in BASES["track"](patch_length=0.0).scenario.disturbances
    for wrong in ({"patch_at": 2.0 * length}, {"patch_length": 2.0 * length}):
        with pytest.raises(rumo.ArgumentError, match="expected a place on the path"):
            BASES["track"](**{"patch_length": 1.0, **wrong})
