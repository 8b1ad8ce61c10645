"""Faults as data: each does what it says, when it says, and the study's drives come out as its callbacks made them."""

from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
import pytest
import xarray as xr
from problems import pendulum

import rumo
from rumo.controllers.engines.base import Candidate, Method
from rumo.controllers.engines.guarded import Guarded
from rumo.controllers.engines.trajectory import Trajectory
from rumo.registry import CONTROLLERS
from rumo.signals import Signals
from rumo.simulation import ClosedLoop, Scenario
from rumo.simulation.faults import (
    KINDS,
    Biased,
    Budget,
    Changed,
    Disturbed,
    Drift,
    Dropout,
    Fault,
    Frozen,
    LateCommand,
    LateMeasurement,
    LostCommand,
    Misinformed,
    Missing,
    Noisy,
    Offset,
    Outliers,
    Reading,
    Saturated,
    Scaled,
    SkippedSample,
    Slow,
    Stuck,
    Swapped,
    Weakened,
    make_fault,
)
from rumo.simulation.variables import SKIPPED
from rumo.status import Status
from rumo.studies.faults import FaultStudy
from rumo.transcription import Transcription

STUDY = FaultStudy(start=0.4, samples=(5,), duration=1.2, keep_logs=True)
BAD = STUDY.bad(5)
AS_DATA = {
    "none": (),
    "nan": (Reading(BAD, "psi", np.nan),),
    "infinite": (Reading(BAD, "v_x", np.inf),),
    "jump": (Offset(BAD, "p_y", 100.0),),
    "spin": (Reading(BAD, "omega", 50.0),),
    "frozen": (Frozen(BAD),),
    "missing": (Missing(BAD),),
    "failure": (Misinformed(BAD, {"torque": 0.0, "steering_rate": 100.0}),),
    "budget": (Budget(BAD),),
}
# Wall-clock times differ; so does what arrived, which the study's estimators spoil after it has.
OWN = ("prepare_time", "feedback_time", "step_time", "waited_time", "received")


def scenario(**changes):
    """A pendulum that swings, its controller with a delay of one sample."""
    problem = changes.pop("problem", None) or pendulum()
    settings = {"plant": problem.model, "x": [0.3, 0.0], "reference": {"angle": 0.1}, "duration": 1.0}
    return Scenario(problem, **(settings | changes))


@pytest.mark.parametrize("name", ["rti", "ltv", pytest.param("nlp", marks=pytest.mark.slow)])
def test_drives_of_the_study(name):
    base = replace(STUDY.base, duration=STUDY.duration, seed=0)
    problem, plant = base.problem(), base.plant()
    drives = replace(STUDY, controllers=(name,), faults=tuple(AS_DATA)).run()[name]
    drives = {fault: by_speed[8.0][5][0] for fault, by_speed in drives.items()}
    controller = CONTROLLERS[name](problem)
    for fault, drive in drives.items():
        log = rumo.simulate(
            controller,
            plant,
            base.initial_state(),
            base.path,
            base.duration,
            sensors=rumo.Sensors(base.noise),
            disturbances={"wind_speed": base.wind, "wind_direction": rumo.simulation.Constant(np.pi / 2.0)},
            faults=AS_DATA[fault],
        )
        assert drive.exception is None
        study = drive.log.drop_vars(OWN).assign_attrs(log.attrs)
        study.attrs = log.attrs
        xr.testing.assert_identical(log.drop_vars(OWN), study)


@pytest.mark.parametrize(
    ("when", "samples"),
    [
        (range(3, 6), range(3, 6)),
        ((0.15, 0.30), range(3, 6)),
        ((0.151, 0.299), range(4, 6)),
        ((0.0, 0.0), range(0)),
        ((0.9, np.inf), range(18, 20_000_000_000_000)),
    ],
)
def test_windows(when, samples):
    found = Missing(when).samples(0.05)
    assert list(found[:5]) == list(samples[:5])
    assert (len(found) > 20) == (len(samples) > 20)


@pytest.mark.parametrize(
    ("fault", "expected"),
    [
        (Reading(range(4, 7), "rate", 9.0), lambda log: {"rate": 9.0}),
        (Offset(range(4, 7), "angle", 0.5), lambda log: {"angle": log.measured.data[4:7, 0] + 0.5}),
        (Frozen(range(4, 7)), lambda log: {"angle": log.measured.data[3, 0], "rate": log.measured.data[3, 1]}),
        (Frozen(range(4, 7), ("rate",)), lambda log: {"rate": log.measured.data[3, 1]}),
        (Missing(range(4, 7), ("rate",)), lambda log: {"rate": np.nan}),
        (LateMeasurement(range(4, 7), by=2), lambda log: {"angle": log.measured.data[2:5, 0]}),
        (Drift(range(4, 7), "angle", 0.2), lambda log: {"angle": log.measured.data[4:7, 0] + 0.2 * np.arange(1, 4)}),
        (Scaled(range(4, 7), ("rate",), -1.0), lambda log: {"rate": -log.measured.data[4:7, 1]}),
        (Scaled(range(4, 7)), lambda log: {"angle": 0.0, "rate": 0.0}),
        (
            Swapped(range(4, 7), "angle", "rate"),
            lambda log: {"angle": log.measured.data[4:7, 1], "rate": log.measured.data[4:7, 0]},
        ),
    ],
)
def test_sensors(fault, expected):
    log = scenario(faults=(fault,), sensors=rumo.Sensors({"angle": 0.01, "rate": 0.02})).run()
    told = log.measured.copy(deep=True)
    for name, values in expected(log).items():
        told.loc[{"state": name}][4:7] = values
    if isinstance(fault, LateMeasurement):
        told[4:7] = log.measured.data[2:5]
    np.testing.assert_array_equal(log.received, told)
    np.testing.assert_array_equal(log.estimated, told)


def test_dropouts_come_by_chance_and_by_seed():
    def lost(samples=100, **settings):
        faults, duration = (Dropout(range(5, 5 + samples), **settings),), 0.05 * (samples + 40)
        log = scenario(faults=faults, duration=duration, plant=Standing()).run()
        np.testing.assert_array_equal(log.received.fillna(log.measured), log.measured)
        return log.received.isnull().data

    some = lost(2000, signals=("rate",))
    assert not some[:5].any()
    assert not some[:, 0].any()
    assert some[5:2005, 1].mean() == pytest.approx(0.5, abs=0.05)
    assert (lost(signals=("rate",))[:105] == some[:105]).all()
    assert (lost(signals=("rate",), seed=1)[:105] != some[:105]).any()
    assert lost(2000, share=0.1)[5:2005].all(axis=1).mean() == pytest.approx(0.1, abs=0.03)
    assert not lost(share=0.0).any()
    assert lost(share=1.0)[5:105].all()


def test_noise_is_added_to_that_of_the_sensors():
    noisy = Noisy(range(5, 2005), {"rate": 0.3})
    log = scenario(faults=(noisy,), duration=102.0, plant=Standing(), sensors=rumo.Sensors({"rate": 0.01})).run()
    added = (log.received - log.measured).data
    assert not added[:5].any()
    assert not added[:, 0].any()
    assert added[5:2005, 1].std() == pytest.approx(0.3, rel=0.05)
    assert abs(added[5:2005, 1].mean()) < 0.03


def test_outliers_are_as_many_and_as_large_as_they_should_be():
    """Each signal for itself; the rest of the measurements is untouched."""
    spoilt = Outliers(range(5, 2005), {"rate": 3.0, "angle": 1.0}, share=0.2)
    log = scenario(faults=(spoilt,), duration=102.0, plant=Standing()).run()
    error = (log.received - log.measured).values
    there = error[5:2005] != 0.0
    assert (error[:5] == 0.0).all()
    assert (error[2005:] == 0.0).all()
    np.testing.assert_allclose(there.mean(axis=0), 0.2, atol=0.03)
    assert there.all(axis=1).mean() == pytest.approx(0.04, abs=0.015)
    for name, deviation in (("rate", 3.0), ("angle", 1.0)):
        column = log.state.values.tolist().index(name)
        assert error[5:2005][there[:, column], column].std() == pytest.approx(deviation, rel=0.15)
    signals, read = Signals({"angle": "rad", "rate": "rad/s"}, "measured"), np.zeros((3, 2))
    for seed, same in ((0, True), (1, False)):
        said = [replace(spoilt, seed=seed).sense(row, (), bad, signals) for bad, row in enumerate(read, 100)]
        assert (np.array(said) == error[105:108]).all() == same


def test_frozen_and_late_from_the_start_are_missing():
    for fault in (Frozen(range(2)), LateMeasurement(range(2), by=2)):
        log = scenario(faults=(fault,)).run()
        assert np.isnan(log.received[:2]).all()
        assert not np.isnan(log.received[2:]).any()


@pytest.mark.parametrize(
    ("fault", "expected"),
    [
        (Stuck(range(4, 7), "torque"), lambda told, done: done[3]),
        (Stuck(range(4, 7), "torque", 0.7), lambda told, done: 0.7),
        (Weakened(range(4, 7), "torque", share=0.5), lambda told, done: 0.5 * told),
        (Saturated(range(4, 7), "torque", -0.1, 0.1), lambda told, done: np.clip(told, -0.1, 0.1)),
        (Biased(range(4, 7), "torque", by=0.3), lambda told, done: told + 0.3),
    ],
)
@pytest.mark.parametrize("delay", [0, 1, 2])
def test_actuators(fault, expected, delay):
    log = scenario(problem=pendulum(delay=delay), faults=(fault,)).run()
    arrived = np.vstack([np.zeros((delay, 1)), log.commanded.data])[: len(log.time)]
    wanted = arrived.copy()
    wanted[4:7] = expected(arrived[4:7], log.applied.data)
    np.testing.assert_array_equal(log.applied, wanted)


@pytest.mark.parametrize("delay", [0, 1, 2])
def test_a_slow_actuator_goes_part_of_the_way(delay):
    log = scenario(problem=pendulum(delay=delay), faults=(Slow(range(4, 7), "torque", share=0.25),)).run()
    arrived = np.vstack([np.zeros((delay, 1)), log.commanded.data])[: len(log.time)]
    wanted = arrived.copy()
    for k in range(4, 7):
        wanted[k] = 0.75 * wanted[k - 1] + 0.25 * arrived[k]
    np.testing.assert_allclose(log.applied, wanted, atol=1e-15)


class Falling:
    """A plant that knows the gravity."""

    states, inputs, parameters = (
        {"angle": "rad", "rate": "rad/s"},
        {"torque": "N m"},
        {"gravity": rumo.Parameter("1/s", 1.0)},
    )

    def advance(self, x, u, p):
        return x + np.array([0.0, p[0]])


def test_a_parameter_of_the_plant_is_another_for_a_while():
    run = scenario(
        plant=Falling(),
        disturbances={"gravity": rumo.simulation.Constant(2.0)},
        faults=(Disturbed(range(4, 7), "gravity", 9.0),),
    )
    log = run.run()
    wanted = np.full(20, 2.0)
    wanted[4:7] = 9.0
    np.testing.assert_array_equal(log.disturbance.data[:, 0], wanted)
    np.testing.assert_allclose(np.diff(log.plant.data[:, 1]), wanted[:-1])
    with pytest.raises(rumo.ArgumentError, match=r"parameter: got 'gravty'.*Did you mean 'gravity'"):
        ClosedLoop(replace(run, faults=(Disturbed(range(2), "gravty", 1.0),)))


def test_the_plant_is_another_for_a_while():
    """Apart from these samples it is the one that it was, from where the other has left it."""
    heavy = heavier()
    log = scenario(faults=(Changed(range(4, 7), heavy),)).run()
    driven = {True: rumo.simulation.Plant(heavy, 0.05), False: rumo.simulation.Plant(pendulum().model, 0.05)}
    x = log.plant.data
    for k in range(len(x) - 1):
        end = driven[k in range(4, 7)].advance(x[k], log.applied.data[k], np.array([9.81]))
        np.testing.assert_allclose(x[k + 1], end, atol=1e-6)
    assert np.abs(x - scenario().run().plant.data).max() > 1e-3


def heavier():
    """The pendulum with three times the mass."""
    return rumo.Model(
        {"angle": "rad", "rate": "rad/s"},
        {"torque": "N m"},
        lambda x, u, p: {"angle": x.rate, "rate": u.torque / 3.0 - p.gravity * x.angle},
        parameters={"gravity": rumo.Parameter("m/s^2", 9.81)},
    )


def test_the_other_plant_has_the_same_signals():
    other = rumo.textbook.cart_pendulum()
    with pytest.raises(rumo.ArgumentError, match=r"Changed.plant: got states position, .*expected those of the plant"):
        ClosedLoop(scenario(faults=(Changed(range(2), other),)))


SETTINGS = {
    "biased": {"input": "torque"},
    "changed": {"plant": pendulum().model},
    "disturbed": {"parameter": "gravity", "value": 9.0},
    "drift": {"signal": "angle", "by": 0.01},
    "misinformed": {"applied": {"torque": 1.0}},
    "noisy": {"noise": {"rate": 0.1}},
    "outliers": {"errors": {"rate": 3.0}},
    "offset": {"signal": "angle", "by": 0.01},
    "reading": {"signal": "angle", "value": 0.1},
    "saturated": {"input": "torque"},
    "slow": {"input": "torque"},
    "stuck": {"input": "torque"},
    "swapped": {"first": "angle", "second": "rate"},
    "weakened": {"input": "torque"},
}


@pytest.mark.parametrize("kind", KINDS)
def test_kinds_are_made_by_name(kind):
    settings = SETTINGS.get(kind, {})
    fault = make_fault(kind, range(4, 7), **settings)
    assert fault == KINDS[kind](range(4, 7), **settings)
    assert scenario(faults=(fault,)).run().sizes["time"] == 20
    for name in settings:
        with pytest.raises(rumo.ArgumentError, match=rf"make_fault\('{kind}'\): got no {name}, expected a value"):
            make_fault(kind, range(4, 7), **{key: value for key, value in settings.items() if key != name})


def test_every_public_fault_has_a_kind():
    public = {item for item in vars(rumo.faults).values() if isinstance(item, type) and issubclass(item, Fault)}
    assert set(KINDS.values()) == public - {Fault}


@pytest.mark.parametrize("told", [False, True])
def test_estimators_learn_what_is_applied_only_if_told(told):
    filters = rumo.estimation.ExtendedKalman({"angle": 1.0, "rate": 1.0}, {"angle": 1e-4, "rate": 1e-4})
    log = scenario(faults=(Stuck((0.2, 1.0), "torque", 2.0, told=told),), estimator=filters).run()
    error = np.abs(log.estimated.data - log.plant.data).max()
    assert (error < 0.05) == told


@pytest.mark.parametrize("delay", [0, 1, 2])
def test_controllers_are_told_what_is_applied(delay):
    """Without delay, the controller's last input is that of the actuator."""
    run = scenario(problem=pendulum(delay=delay), faults=(Stuck(range(4, 7), "torque", 1.5, told=True),))
    loop = ClosedLoop(run)
    last = [loop.controller.applied[0, 0] for _ in loop]
    if delay == 0:
        assert last[4:7] == [1.5] * 3
    assert 1.5 not in last[:4] + last[7:]


class ByReference(Method):
    """The command is what the reference says."""

    def __init__(self, problem):
        self.transcription = Transcription(problem)

    def solve(self, x, window, guess, applied):
        u = np.full_like(guess.u, window["angle"][0])
        return Candidate(Trajectory(u, guess.x, guess.inner), np.zeros((len(u), 0)), Status.OPTIMAL)


@dataclass(frozen=True)
class Listening:
    """An estimator that notes what it is told of the inputs."""

    heard: list = field(default_factory=list)

    def start(self, problem, measured=None, discretization=None):
        return self

    def update(self, measured, applied, parameters):
        self.heard.append(f"{applied[0]:.0f}")
        return rumo.estimation.Estimate(measured)


@dataclass(frozen=True)
class Watching(Fault):
    """None: it notes what the controller takes for decided at each step."""

    listening: Listening
    seen: dict = field(default_factory=dict)

    def around(self, controller):
        now = len(self.listening.heard) - 1
        self.seen[now] = "".join(f"{u:.0f}" for u in controller.applied[:, 0])
        return super().around(controller)


class Standing:
    """A plant that nothing moves."""

    states, inputs = {"angle": "rad", "rate": "rad/s"}, {"torque": "N m"}

    def advance(self, x, u, p):
        return x


@cache
def by_reference(delay):
    method, settings = ByReference(pendulum(delay=delay, bounds=None)), rumo.ControllerSettings(gate=None)
    return rumo.Controller(method.transcription, Guarded(method, settings), settings)


def what_they_know(delay, *bad):
    """Inputs in a run of 8 samples: applied, as the estimator hears, as the controller sees at each step.

    The commands are 1, 2, 3 ...; 0 was decided before the start.
    """
    listening = Listening()
    watching = Watching(range(8), listening)
    log = rumo.simulate(
        by_reference(delay),
        Standing(),
        [0.0, 0.0],
        lambda t: {"angle": np.round(t / 0.05) + 1.0},
        0.4,
        estimator=listening,
        faults=(*bad, watching),
    )
    return "".join(f"{u:.0f}" for u in log.applied.data[:, 0]), "".join(listening.heard), watching.seen


TWO, ONE = range(2, 4), range(1, 2)
LOST, LATE, SKIPS = LostCommand(TWO), LateCommand(TWO, by=1), SkippedSample(TWO)
STUCK = Stuck(TWO, "torque", 9.0)
# Faults, delay, what the actuators do from each sample to the next, what controller and estimator believe they do.
KNOWLEDGE = [
    ((), 0, "12345678", "12345678"),
    ((), 1, "01234567", "01234567"),
    ((), 2, "00123456", "00123456"),
    ((LOST,), 0, "12225678", "12345678"),
    ((LOST,), 1, "01222567", "01234567"),
    ((LOST,), 2, "00122256", "00123456"),
    ((replace(LOST, told=True),), 0, "12225678", "12225678"),
    ((replace(LOST, told=True),), 1, "01222567", "01222567"),
    ((replace(LOST, told=True),), 2, "00122256", "00122256"),
    ((LATE,), 0, "12235678", "12345678"),
    ((LATE,), 1, "01223567", "01234567"),
    ((LATE,), 2, "00122356", "00123456"),
    ((replace(LATE, told=True),), 0, "12235678", "12235678"),
    ((replace(LATE, told=True),), 1, "01223567", "01223567"),
    ((replace(LATE, told=True),), 2, "00122356", "00122356"),
    ((STUCK,), 0, "12995678", "12345678"),
    ((STUCK,), 1, "01994567", "01234567"),
    ((STUCK,), 2, "00993456", "00123456"),
    ((replace(STUCK, told=True),), 0, "12995678", "12995678"),
    ((replace(STUCK, told=True),), 1, "01994567", "01994567"),
    ((replace(STUCK, told=True),), 2, "00993456", "00993456"),
    ((SKIPS,), 0, "12225678", "12225678"),
    ((SKIPS,), 1, "01222567", "01222567"),
    ((SKIPS,), 2, "00122256", "00122256"),
    # What was lost before is not learned by running again; what an actuator is known to do is.
    ((LostCommand(ONE), SKIPS), 0, "11115678", "12225678"),
    ((LostCommand(ONE), SKIPS), 1, "01111567", "01222567"),
    ((LostCommand(ONE), SKIPS), 2, "00111156", "00122256"),
    ((replace(STUCK, told=True), SKIPS), 0, "12995678", "12995678"),
    ((replace(STUCK, told=True), SKIPS), 1, "01992567", "01992567"),
    ((replace(STUCK, told=True), SKIPS), 2, "00992256", "00992256"),
    # A late command arrives while the controller does not run, and then.
    ((LateCommand(ONE), SkippedSample(range(2, 3))), 0, "11245678", "12245678"),
    ((LateCommand(ONE, by=2), SKIPS), 0, "11125678", "12225678"),
    ((LateCommand(ONE, by=2, told=True), SKIPS), 1, "01112567", "01112567"),
]


@pytest.mark.parametrize(("bad", "delay", "applied", "believed"), KNOWLEDGE)
def test_what_everybody_knows(bad, delay, applied, believed):
    done, heard, seen = what_they_know(delay, *bad)
    assert done == applied
    assert heard == "0" + believed[:-1]
    # The last input without delay; that of now with a delay, and those of the next samples.
    told_later = replace(STUCK, told=True) in bad
    for k, decided in seen.items():
        assert decided[0] == (believed[k] if delay else heard[k])
        assert told_later or believed[k:].startswith(decided) or k == 7 or not delay


def test_nobody_knows_a_fault_of_an_actuator_before_it_is_there():
    seen = what_they_know(2, replace(STUCK, told=True))[2]
    assert list(seen.values()) == ["00", "01", "92", "93", "34", "45", "56", "67"]


@pytest.mark.parametrize("delay", [0, 1, 2, 3])
def test_a_controller_is_misinformed_at_bad_samples_only(delay):
    applied, heard, right = what_they_know(delay)
    misled = what_they_know(delay, Misinformed(TWO, {"torque": 9.0}))
    assert misled == (applied, heard, right | dict.fromkeys(TWO, "9" * max(delay, 1)))


@pytest.mark.parametrize("delay", [0, 1, 2])
def test_late_commands_are_applied_late(delay):
    log = scenario(problem=pendulum(delay=delay), faults=(LateCommand(range(4, 7), by=1),)).run()
    applied, commanded, first = log.applied.data, log.commanded.data, 4 + delay
    np.testing.assert_array_equal(applied[first], applied[first - 1])  # held
    np.testing.assert_array_equal(applied[first + 1 : first + 3], commanded[4:6])
    # The command of the last bad sample comes with that of the next good one, which counts.
    np.testing.assert_array_equal(applied[first + 3 :], commanded[7 : len(commanded) - delay])


@pytest.mark.parametrize("delay", [0, 1, 2])
def test_lost_commands_leave_the_last(delay):
    log = scenario(problem=pendulum(delay=delay), faults=(LostCommand(range(4, 7)),)).run()
    applied, first = log.applied.data, 4 + delay
    np.testing.assert_array_equal(applied[first : first + 3], np.tile(applied[first - 1], (3, 1)))
    np.testing.assert_array_equal(applied[first + 3 :], log.commanded.data[7 : len(applied) - delay])


@pytest.mark.parametrize("delay", [0, 1, 2])
def test_skipped_samples(delay):
    loop = ClosedLoop(scenario(problem=pendulum(delay=delay), faults=(SkippedSample(range(4, 7)),)))
    asked = []
    for sample in loop:
        asked.append(loop.controller.applied)
        assert (sample.plan is None) == (sample.commanded is None) == (sample.index in range(4, 7))
    log = loop.scenario.run()
    first, applied = 4 + delay, log.applied.data
    np.testing.assert_array_equal(applied[first : first + 3], np.tile(applied[first - 1], (3, 1)))
    assert log.status.data[4:7].tolist() == [SKIPPED] * 3
    assert np.isnan(log.predicted_states[4:7]).all()
    assert np.isnan(log.commanded[4:7]).all()
    # When it runs again, it knows what was applied meanwhile.
    if delay:
        np.testing.assert_array_equal(asked[7][-1], log.commanded[7])
        np.testing.assert_array_equal(log.predicted_inputs[7, :delay], applied[7 : 7 + delay])


def test_budget_is_given_back():
    controller = rumo.RealTimeIteration(pendulum(bounds={"torque": (-3.0, 3.0)}))
    settings = controller.settings
    log = scenario(problem=controller.problem, faults=(Budget(range(4, 7)),)).run(controller)
    assert controller.settings is settings
    assert "BUDGET_EXCEEDED" in log.status.data[4:7]
    assert set(log.status.data[8:]) == {"OPTIMAL"}


def test_faults_act_one_after_the_other():
    faults = (Offset(range(4, 7), "angle", 1.0), Offset(range(5, 9), "angle", 2.0))
    log = scenario(faults=faults).run()
    off = (log.received - log.measured).sel(state="angle").data
    np.testing.assert_allclose(off[:10], [0.0, 0.0, 0.0, 0.0, 1.0, 3.0, 3.0, 2.0, 2.0, 0.0], atol=1e-12)


def test_a_fault_of_ones_own():
    @dataclass(frozen=True)
    class Drifting(Fault):
        rate: float = 0.1

        def sense(self, received, past, bad, signals):
            return received + self.rate * (bad + 1)

    log = scenario(faults=(Drifting(range(4, 7)),)).run()
    np.testing.assert_allclose((log.received - log.measured)[3:8, 0], [0.0, 0.1, 0.2, 0.3, 0.0], atol=1e-12)


def test_faults_may_change_what_they_are_given_but_not_the_past():
    @dataclass(frozen=True)
    class InPlace(Fault):
        def sense(self, received, past, bad, signals):
            received += 1.0
            return received

        def act(self, applied, past, bad, inputs):
            applied += 1.0
            return applied

    @dataclass(frozen=True)
    class Forging(Fault):
        def sense(self, received, past, bad, signals):
            past[-1][:] = 0.0

    log = scenario(faults=(InPlace(range(4, 7)),)).run()
    np.testing.assert_array_equal(log.measured, log.plant)
    np.testing.assert_array_equal(log.received[4:7], log.measured[4:7] + 1.0)
    np.testing.assert_array_equal(log.applied[4:7], log.commanded.data[3:6] + 1.0)
    np.testing.assert_array_equal(log.commanded, log.predicted_inputs[:, 1])
    with pytest.raises(ValueError, match="read-only"):
        scenario(faults=(Forging(range(4, 7)),)).run()


@dataclass(frozen=True)
class Answering(Fault):
    """A fault whose methods answer the same, whatever is."""

    sensed: object = (0.0, 0.0)
    acted: object = (0.0,)

    def sense(self, received, past, bad, signals):
        return self.sensed

    def act(self, applied, past, bad, inputs):
        return self.acted


@pytest.mark.parametrize(
    ("answers", "message"),
    [
        ({"sensed": None}, r"Answering.sense\(\): got shape \(\), expected shape \(2,\)"),
        ({"sensed": (0.0, 0.0, 0.0)}, r"Answering.sense\(\): got shape \(3,\), expected shape \(2,\)"),
        ({"acted": (0.0, 0.0)}, r"Answering.act\(\): got shape \(2,\), expected shape \(1,\)"),
        ({"acted": (np.nan,)}, r"Answering.act\(\)\['torque'\]: got nan, expected a finite number"),
    ],
)
def test_answers_of_faults_are_checked(answers, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        scenario(faults=(Answering(range(1, 2), **answers),)).run()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Missing(range(6, 0, -1)), r"when: got range\(6, 0, -1\), expected samples one after the other"),
        (lambda: Missing(3), r"when: got 3, expected range\(first, end\) of samples, or \(start, end\) in seconds"),
        (lambda: Missing("12"), r"when: got '12', expected range\(first, end\) of samples"),
        (lambda: Missing((2.0, 1.0)), r"when: got \(2.0, 1.0\), expected a start of at least 0 s, and an end after"),
        (lambda: LateCommand(range(2), by=0), "by: got 0, expected a whole number of at least 1"),
        (lambda: Budget(range(2), iterations=-1), "iterations: got -1, expected a whole number"),
        (lambda: scenario(faults=Missing(range(2))), r"faults: got Missing.*expected a tuple"),
        (lambda: scenario(faults=("nan",)), "faults: got 'nan', expected a rumo.Fault"),
        (lambda: Missing(range(5, 3)), r"when: got range\(5, 3\), expected samples one after the other"),
        (lambda: Missing((np.inf, np.inf)), r"when: got \(inf, inf\), expected a start"),
        (lambda: Missing((np.nan, 1.0)), r"when: got \(nan, 1.0\), expected a start"),
        (lambda: Missing(range(2), "angle"), r"signals: got 'angle', expected a tuple of names. Write \('angle',\)"),
        (lambda: LateMeasurement(range(2), by=-1), "by: got -1, expected a whole number of at least 1"),
        (lambda: LateMeasurement(range(2), by=1.5), "by: got 1.5, expected a whole number of at least 1"),
        (lambda: LateCommand(range(2), told="no"), "told: got 'no', expected True or False"),
        (lambda: Reading(range(2), "angle", "high"), "value: got 'high', expected numbers"),
        (lambda: Reading(range(2), "angle", (0.1, 0.2)), r"value: got \(0.1, 0.2\), expected a number"),
        (lambda: Offset(range(2), "angle", np.inf), "by: got inf, expected a finite number"),
        (lambda: Stuck(range(2), "torque", np.nan), "value: got nan, expected a finite number"),
        (lambda: Weakened(range(2), "torque", share=np.nan), "share: got nan, expected a finite number"),
        (lambda: Biased(range(2), "torque", by="1"), "by: got '1', expected a finite number"),
        (
            lambda: Slow(range(2), "torque", share=0.0),
            "share: got 0.0, expected a part of the way, above 0 and up to 1",
        ),
        (lambda: Slow(range(2), "torque", share=1.1), "share: got 1.1, expected a part of the way"),
        (lambda: Drift(range(2), "angle", np.nan), "by: got nan, expected a finite number"),
        (lambda: scenario(faults=(Drift(range(2), "ange", 1.0),)), "Did you mean 'angle'"),
        (lambda: Dropout(range(2), share=1.5), "share: got 1.5, expected a probability from 0 to 1"),
        (lambda: Dropout(range(2), share=-0.1), "share: got -0.1, expected a probability from 0 to 1"),
        (lambda: Dropout(range(2), seed=-1), "seed: got -1, expected a whole number of at least 0"),
        (lambda: Scaled(range(2), factor=np.inf), "factor: got inf, expected a finite number"),
        (lambda: scenario(faults=(Scaled(range(2), ("ange",)),)), "Did you mean 'angle'"),
        (lambda: scenario(faults=(Swapped(range(2), "angle", "angle"),)), "second: got 'angle', expected another"),
        (lambda: scenario(faults=(Swapped(range(2), "ange", "rate"),)), "Did you mean 'angle'"),
        (lambda: Noisy(range(2), {"angle": -1.0}), r"noise\['angle'\]: got -1.0, expected a standard deviation of 0"),
        (lambda: Outliers(range(2), {"angle": -1.0}), r"errors\['angle'\]: got -1.0, expected a number of at least 0"),
        (lambda: Outliers(range(2), {"angle": 1.0}, share=1.5), "share: got 1.5, expected a share from 0 to 1"),
        (lambda: scenario(faults=(Outliers(range(2), {"ange": 1.0}),)), "Did you mean 'angle'"),
        (lambda: Noisy(range(2), 3.0), "noise: got 3.0, expected a mapping"),
        (lambda: scenario(faults=(Noisy(range(2), {"ange": 1.0}),)), "Did you mean 'angle'"),
        (lambda: Disturbed(range(2), "gravity", np.inf), "value: got inf, expected a finite number"),
        (lambda: Changed(range(2), "pendulum"), "plant: got 'pendulum', expected a rumo.Model or a rumo.simulation"),
        (lambda: make_fault("ofset", range(2)), "kind: got 'ofset'.*Did you mean 'offset'"),
        (lambda: make_fault("offset", range(2), sinal="angle"), "got 'sinal'.*Did you mean 'signal'"),
        (lambda: make_fault("offset", range(2), signal="angle"), r"make_fault\('offset'\): got no by, expected"),
        (lambda: Saturated(range(2), "torque", 1.0, -1.0), r"lower, upper: got \(1.0, -1.0\), expected two limits"),
        (lambda: Saturated(range(2), "torque", upper=np.nan), r"lower, upper: got \(-inf, nan\), expected two limits"),
        (lambda: Saturated(range(2), "torque", np.inf), r"lower, upper: got \(inf, inf\), expected two limits"),
        (lambda: Misinformed(range(2), {"torque": np.nan}), r"applied\['torque'\]: got nan, expected a finite number"),
        (lambda: Misinformed(range(2), [1.0]), r"applied: got \[1.0\], expected a mapping"),
        (lambda: scenario(faults=(Reading(range(2), "ange", 0.0),)), "Did you mean 'angle'"),
        (lambda: scenario(faults=(Missing(range(2), ("ange",)),)), "Did you mean 'angle'"),
        (lambda: scenario(faults=(Stuck(range(2), "torqe"),)), "Did you mean 'torque'"),
        (lambda: scenario(faults=(Misinformed(range(2), {}),)), "applied: got no value for torque"),
    ],
)
def test_mistakes(make, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        make()
