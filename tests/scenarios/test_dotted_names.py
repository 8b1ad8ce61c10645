"""Settings by dotted names: each changes what it says and nothing else, or says what it could be."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from problems import pendulum

import rumo
from rumo.estimation import Butterworth, ExtraState, MovingHorizon
from rumo.scenarios import BASES, KINDS, changed, settings_of
from rumo.scenarios.kinds import made
from rumo.simulation import Constant, Gust
from rumo.simulation.faults import LateCommand, Missing, Offset

PAPER = BASES["paper"]()
GUST = {"kind": "Gust", "mean": 0.0, "peak": 5.0, "start": 1.0, "duration": 2.0}


def after(name, value, run=PAPER):
    return changed(run, {name: value})


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("seed", 7),
        ("duration", 5.0),
        ("backend", "portable"),
        ("discretization", "radau2"),
        ("controller", "nlp"),
        ("x.p_y", 2.0),
        ("applied.torque", 10.0),
        ("settings.sqp_iterations", 3),
        ("settings.gate.width", 3.0),
        ("settings.qp.tolerance", 1e-8),
        ("sensors.noise.p_x", 0.2),
        ("estimator.cutoff", 2.0),
        ("disturbances.wind_speed.std", 0.5),
        ("disturbances.wind_direction.value", 0.3),
        ("reference.amplitude", 2.0),
        ("plant.m", 230.0),
        ("plant.mu", 0.8),
        ("problem.weights.p_y", 2.5),
        ("problem.weights.torque", 1.5),
        ("problem.ranges.p_y", 5.0),
        ("problem.bounds.torque.upper", 250.0),
        ("problem.bounds.delta.lower", -0.5),
        ("problem.limits.friction_front", -0.1),
        ("problem.penalties.friction_front.l1", 4.0),
        ("problem.penalties.friction_front.l2", 0.5),
        ("problem.penalties.delta_upper.l1", 2.0),
        ("problem.parameters.mu", 0.8),
        ("problem.safe_input.torque", -20.0),
    ],
)
def test_a_setting_changes_itself_alone(name, value):
    before, found = settings_of(PAPER), settings_of(after(name, value))
    assert found.pop(name) == value
    del before[name]
    # Others that mean the same, or belong to another controller.
    same = {"disturbances": {"plant.wind_direction"}, "problem": {"applied.torque"}}.get(name.partition(".")[0], set())
    if name == "controller":
        before = {key: item for key, item in before.items() if not key.startswith("settings")}
        found = {key: item for key, item in found.items() if not key.startswith("settings")}
    own = {key: item for key, item in found.items() if key in before and key not in same}
    assert own == {key: before[key] for key in own}
    assert {*found} - {*before} <= {f"disturbances.{name.partition('.')[2]}.value"}


def test_numbers_reach_the_problem():
    found = changed(
        PAPER,
        {"problem.bounds.torque.lower": -100.0, "problem.bounds.torque.upper": 50, "problem.weights.p_y": [2.0] * 15},
    )
    assert found.problem.input_lower[0] == -100.0
    assert found.problem.input_upper[0] == 50.0
    assert (found.problem.numbers.tracking[:, 1] == 2.0).all()
    assert PAPER.problem.input_upper[0] == 300.0


def test_problems_with_the_same_numbers_are_the_same():
    first, second = (after("problem.weights.p_y", 2.0).problem for _ in range(2))
    assert first is second
    assert after("problem.weights.p_y", 1.0).problem is PAPER.problem


def test_stages_may_differ():
    weights = [1.0 + 0.1 * k for k in range(15)]
    assert settings_of(after("problem.weights.p_y", weights))["problem.weights.p_y"] == weights


def test_move_bounds_are_those_that_there_are():
    problem = pendulum(move_bounds={"torque": (-0.5, 0.5)})
    run = rumo.Scenario(problem, problem.model, {"angle": 0.1, "rate": 0.0}, {"angle": 0.0}, 1.0)
    found = changed(run, {"problem.move_bounds.torque.upper": 0.2, "plant.gravity": 1.6, "x.rate": 0.3})
    assert (found.problem.move_lower[0], found.problem.move_upper[0]) == (-0.5, 0.2)
    assert found.disturbances == {"gravity": Constant(1.6)}
    assert found.x == {"angle": 0.1, "rate": 0.3}


def test_tables_make_what_they_say():
    found = changed(
        PAPER,
        {
            "disturbances.wind_speed": GUST,
            "disturbances.mu": 0.7,
            "faults": [
                {"kind": "Missing", "when": [1.0, 2.0], "signals": ["p_x"]},
                {"kind": "LateCommand", "when": {"from": 10, "to": 20}, "by": 2, "told": True},
            ],
            "estimator": {
                "kind": "MovingHorizon",
                "window": 4,
                "filter": {
                    "noise": {"p_x": 0.1},
                    "process": {"p_x": 0.1},
                    "extra": {"mu": {"drift": 0.1, "deviation": 0.2}},
                    "discretization": "radau2",
                },
                "bounds": {"mu": [0.2, 1.2]},
            },
            "actuation": {"computation": 0.02, "actuators": {"torque": {"lag": 0.1}}},
            "monitors.steering": {"kind": "DelayWatch", "command": "steering_rate", "response": "delta"},
            "settings.gate": {"width": 4},
        },
    )
    assert found.disturbances["wind_speed"] == Gust(0.0, 5.0, 1.0, 2.0)
    assert found.disturbances["mu"] == Constant(0.7)
    assert found.faults == (Missing((1.0, 2.0), ("p_x",)), LateCommand(range(10, 20), 2, told=True))
    assert isinstance(found.estimator, MovingHorizon)
    assert found.estimator.filter.extra == {"mu": ExtraState(0.1, 0.2)}
    assert found.estimator.filter.discretization == rumo.Radau2()
    assert found.estimator.bounds == {"mu": (0.2, 1.2)}
    assert found.actuation == rumo.Actuation({"torque": rumo.Actuator(lag=0.1)}, 0.02)
    assert found.monitors["steering"].command == "steering_rate"
    assert found.settings == {"gate": rumo.InnovationGate(4.0)}


def test_parts_of_what_a_table_makes_can_be_set_beside_it():
    found = changed(PAPER, {"disturbances.wind_speed.peak": 9.0, "disturbances.wind_speed": GUST})
    assert found.disturbances["wind_speed"] == Gust(0.0, 9.0, 1.0, 2.0)
    faults = changed(PAPER, {"faults": [{"kind": "Offset", "when": [1, 2], "signal": "p_y", "by": 1}]})
    later = changed(faults, {"faults.0.by": 2.0, "faults.0.when.1": 3.0})
    assert later.faults == (Offset((1.0, 3.0), "p_y", 2.0),)
    samples = changed(faults, {"faults.0.when": {"from": 3, "to": 6}})
    assert changed(samples, {"faults.0.when.to": 9}).faults[0].when == range(3, 9)


def test_what_may_be_nothing_can_be_taken_away():
    assert after("estimator", "none").estimator is None
    assert after("settings.gate", "none").settings == {"gate": None}
    assert changed(after("backend", "portable"), {"backend": "none"}).backend is None


def test_a_part_that_is_not_there_begins_as_its_type_does():
    found = changed(PAPER, {"actuation.computation": 0.03, "actuation.actuators.torque": {"rate": 100.0}})
    assert found.actuation == rumo.Actuation({"torque": rumo.Actuator(rate=100.0)}, 0.03)


def test_only_the_real_time_iteration_has_backends():
    found = changed(PAPER, {"backend": "portable", "controller": "ltv"})
    assert (found.controller, found.backend) == ("ltv", None)
    found = changed(after("backend", "portable"), {"controller": "ltv"})
    assert (found.controller, found.backend) == ("ltv", None)


def test_settings_follow_the_controller():
    found = changed(PAPER, {"settings.max_iterations": 50, "controller": "nlp"})
    assert found.settings == {"max_iterations": 50}
    whole = replace(PAPER, settings=rumo.Settings(sqp_iterations=2))
    assert changed(whole, {"settings.tolerance": 1e-6}).settings == rumo.Settings(sqp_iterations=2, tolerance=1e-6)


@dataclass(frozen=True)
class Half:
    """A run of a user's own."""

    scenario: rumo.Scenario
    share: float = 0.5
    words: str = "half"

    def run(self):
        return replace(self.scenario, duration=self.share * self.scenario.duration).run()


def test_runs_of_ones_own_have_their_scenarios_settings():
    run = Half(PAPER)
    assert settings_of(run).items() >= {"share": 0.5, "words": "half", "duration": 24.0}.items()
    found = changed(run, {"share": 0.25, "seed": 3, "problem.weights.p_y": 2.0})
    assert found == Half(found.scenario, 0.25)
    assert found.scenario.seed == 3


def test_states_may_be_given_in_order():
    run = replace(PAPER, x=np.arange(11.0), applied=[10.0, 0.1])
    assert settings_of(run).items() >= {"x.p_y": 1.0, "applied.torque": 10.0}.items()
    found = changed(run, {"x.p_y": 5.0, "applied.steering_rate": 0.2})
    assert (found.x["p_y"], found.x["delta"], found.applied) == (5.0, 10.0, {"torque": 10.0, "steering_rate": 0.2})


@pytest.mark.parametrize("kind", KINDS.values(), ids=lambda kind: kind.__name__)
def test_kinds_are_known_by_their_names(kind):
    assert KINDS[kind.__name__] is kind
    with pytest.raises(rumo.ArgumentError, match=r"part: got 'nonsense', expected one of"):
        made({"kind": kind.__name__, "nonsense": 1}, "part")


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("sed", 1, r"sed: got 'sed', .*Did you mean 'seed'"),
        ("problem.weights.p_z", 1.0, r"problem\.weights\.p_z: got 'p_z', expected one of p_x, p_y, psi"),
        ("problem.horizon", 20, r"problem\.horizon: got 'horizon', expected one of weights, ranges"),
        ("problem.weights.p_y", -1.0, r"problem\.weights\.p_y: got weight -1.0"),
        ("problem.weights.p_y", "much", r"problem\.weights\.p_y: got 'much', expected a number, such as 1.0"),
        ("problem.weights.p_y", True, r"problem\.weights\.p_y: got True, expected a number"),
        ("problem.weights.p_y", [1.0, 2.0], r"problem\.weights\.p_y: got 2 weights, expected one weight, or 15"),
        ("problem.bounds.torque.upper", -400.0, r"problem\.bounds\.torque\.upper: .*\(-300, -400\)"),
        ("problem.penalties.friction_front.l1", 0.0, r"problem\.penalties\.friction_front\.l1: .*l1 > 0"),
        ("plant.mass", 1.0, r"plant\.mass: got 'mass', expected one of wind_speed"),
        ("plant.m", -1.0, r"plant\.m: got -1.0, expected a positive number"),
        ("disturbances.mass", 1.0, r"disturbances\.mass: got 'mass', expected one of wind_speed"),
        ("disturbances.wind_speed", {"kind": "Gsut"}, r"wind_speed\.kind: got 'Gsut', .*Did you mean 'Gust'"),
        ("disturbances.wind_speed", {"mean": 1.0}, r"wind_speed: got a table without kind"),
        ("disturbances.wind_speed", {**GUST, "duration": -1.0}, r"wind_speed\.duration: got -1.0"),
        ("disturbances.wind_speed", {"kind": "Gust", "mean": 1.0}, r"wind_speed\.peak: got nothing"),
        ("disturbances.wind_speed", {"kind": "Missing", "when": [0, 1]}, r"wind_speed: got Missing"),
        ("disturbances.wind_speed", "storm", r"wind_speed: got 'storm', expected a disturbance"),
        ("disturbances.wind_speed.mean", float("nan"), r"wind_speed\.mean: got nan"),
        ("faults", [{"kind": "Missing", "when": [2.0, 1.0]}], r"faults\.0\.when: got \(2.0, 1.0\)"),
        ("faults", [{"kind": "Missing", "when": {"from": 0.5, "to": 1}}], r"faults\.0\.when\.from: got 0.5"),
        ("faults", [{"kind": "Missing", "when": [1, 2], "signals": ["p_z"]}], r"faults: got 'p_z'"),
        ("faults", 3, r"faults: got 3"),
        ("faults.0.by", 1.0, r"faults\.0: got '0'|faults\.0\.by: got '0'"),
        ("seed", 1.5, r"seed: got 1.5, expected a whole number, such as 0"),
        ("seed", -1, r"seed: got -1"),
        ("duration", 0.0, r"duration: got 0.0, expected at least one sampling time"),
        ("controller", "lqr", r"controller: got 'lqr', expected one of rti, nlp, ltv"),
        ("discretization", "euler", r"discretization: got 'euler', expected one of implicit-euler"),
        ("settings.iterations", 1, r"settings\.iterations: got 'iterations'.*sqp_iterations"),
        ("settings.sqp_iterations", 0, r"settings\.sqp_iterations: got 0"),
        ("x.p_z", 1.0, r"x\.p_z: got 'p_z', expected one of p_x"),
        ("estimator.cutof", 1.0, r"estimator\.cutof: got 'cutof', .*Did you mean 'cutoff'"),
        ("estimator.cutoff.share", 1.0, r"estimator\.cutoff\.share: got 'share'"),
        ("estimator", {"kind": "Butterworth", "order": "one"}, "."),
        ("problem", 1, r"problem: got 1"),
    ],
)
def test_what_cannot_be_is_named(name, value, said):
    if said == ".":  # is found out when it starts
        assert after(name, value).estimator == Butterworth(order="one")
        return
    with pytest.raises(rumo.ArgumentError, match=said):
        after(name, value)


def test_a_fault_is_of_so_many_samples():
    missing = {"kind": "Missing", "when": {"from": 10, "samples": 0}}
    run = changed(BASES["paper"](duration=1.0), {"faults": [missing]})
    assert run.faults[0].when == range(10, 10)
    assert changed(run, {"faults.0.when.samples": 4}).faults[0].when == range(10, 14)
    assert changed(run, {"faults.0.when.from": 12}).faults[0].when == range(12, 12)
    assert changed(run, {"faults.0.when.from": 12, "faults.0.when.samples": 4}).faults[0].when == range(12, 16)
    with pytest.raises(rumo.ArgumentError, match="samples"):
        changed(run, {"faults.0.when.to": 20, "faults.0.when.samples": 4})
    with pytest.raises(rumo.ArgumentError, match="samples"):
        changed(run, {"faults.0.when.samples": -1})
