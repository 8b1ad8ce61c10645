"""Sensors: what is measured, noise by signal, lateness, and the plant seen with the controller's eyes."""

import numpy as np
import pytest
from problems import pendulum

import rumo
from rumo.estimation import ExtendedKalman, Unfiltered
from rumo.references import Following, SinePath
from rumo.simulation import Sensors
from rumo.simulation.faults import Missing
from rumo.simulation.foreign import as_plant
from rumo.studies import PaperStudy
from rumo.vehicles import PAPER_CAR, dynamic_bicycle, four_wheel

PLANT, MODEL = as_plant(four_wheel(PAPER_CAR), 0.04), dynamic_bicycle(PAPER_CAR)
X, U, P = np.arange(1.0, 12.0), np.zeros(2), np.zeros(3)


def readings(sensors, samples=500, seed=0):
    """What the sensors say of a plant that stays where it is (K, m)."""
    running = sensors.start(PLANT, sensors.signals(PLANT, MODEL), samples, np.random.default_rng(seed))
    return np.array([running.read(k, X, U, P) for k in range(samples)])


def test_plant_states_reach_the_controller_by_name():
    # Body states as they are, the means of each axle's wheels (7, 8) and (9, 10), the steering angle last.
    exact = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.5, 9.5, 11.0]
    np.testing.assert_array_equal(readings(Sensors(), 3), np.tile(exact, (3, 1)))


def test_noise_belongs_to_the_signal_it_names():
    noise = readings(Sensors({"psi": 0.01, "p_x": 0.05})) - readings(Sensors())
    # Standard error of a deviation over 500 samples: 3 %; four of them.
    np.testing.assert_allclose(noise.std(axis=0)[[0, 2]], [0.05, 0.01], rtol=0.13)
    np.testing.assert_array_equal(noise[:, [1, *range(3, 9)]], 0.0)


def test_outputs_have_the_noise_of_the_states_or_their_own():
    both = readings(Sensors({"w_fl": 0.2, "w_fr": 0.2}, ("w_f",)))
    own = readings(Sensors({"w_fl": 0.2, "w_fr": 0.2, "w_f": 0.01}, ("w_f",)))
    np.testing.assert_allclose(both.std(axis=0), 0.2 / np.sqrt(2.0), rtol=0.13)
    np.testing.assert_allclose(own.std(axis=0), 0.01, rtol=0.13)
    np.testing.assert_allclose([both.mean(), own.mean()], 7.5, atol=0.03)


def test_what_is_measured_and_when():
    plain = readings(Sensors({"psi": 0.1}, ("v_x", "psi")))
    late = readings(Sensors({"psi": 0.1}, ("v_x", "psi"), late={"psi": 3}))
    np.testing.assert_array_equal(late[:, 0], 4.0)
    assert np.isnan(late[:3, 1]).all()
    np.testing.assert_array_equal(late[3:, 1], plain[:-3, 1])


LATE = {"angle": 0.3, "rate": 2.6}


def at_rest_moved(problem, log, k, samples):
    """The plant's state that many samples before sample k, by CVODES from the sample before it."""
    begin = int(np.floor(k - samples))
    state, u = log["plant"].to_numpy()[begin], log["applied"].to_numpy()[begin]
    plant = rumo.Plant(problem.model, problem.sampling_time, 1e-10)
    return plant.advance(state, u, np.array([9.81]), (k - samples - begin) * problem.sampling_time)


def test_fractions_of_a_sample_are_measured_between_samples():
    problem = pendulum(delay=0)
    exact = {"angle": 1e-6, "rate": 1e-6}
    filtered = ExtendedKalman(exact, exact, {"angle": 0.3, "rate": 0.0}, {"angle": 1e-6, "rate": 1e-6}, late=LATE)
    log = rumo.Scenario(
        problem,
        rumo.Plant(problem.model, 0.05, 1e-10),
        [0.3, 0.0],
        {"angle": 0.1},
        1.0,
        sensors=Sensors(late=LATE),
        estimator=filtered,
        discretization=rumo.Radau3(substeps=2),
    ).run()
    measured = log["measured"].to_numpy()
    for j, samples in enumerate(LATE.values()):
        first = int(np.ceil(samples))
        assert np.isnan(measured[:first, j]).all()
        found = [at_rest_moved(problem, log, k, samples)[j] for k in range(first, 20)]
        np.testing.assert_allclose(measured[first:, j], found, atol=1e-7)
    # A filter that knows finds the state now.
    np.testing.assert_allclose(log["estimated"], log["plant"], atol=1e-6)


def test_seconds_are_samples():
    problem = pendulum(delay=1)
    logs = [
        rumo.Scenario(
            problem,
            problem.model,
            [0.3, 0.0],
            {"angle": 0.1},
            0.5,
            sensors=Sensors({"angle": 0.01}, **late),
            estimator=ExtendedKalman(
                {"angle": 0.01, "rate": 0.01}, {"angle": 1e-3, "rate": 1e-3}, *first, late={"angle": 2}
            ),
        ).run()
        for first in [({"angle": 0.3}, {"angle": 0.1})]
        for late in ({"late": {"angle": 2}}, {"age": {"angle": 0.1}})
    ]
    np.testing.assert_array_equal(logs[0]["measured"], logs[1]["measured"])
    np.testing.assert_array_equal(logs[0]["plant"], logs[1]["plant"])


@pytest.mark.parametrize(
    ("sensors", "message"),
    [
        (Sensors({"omga": 0.01}), r"noise: got 'omga', .* Did you mean 'omega'\?"),
        (Sensors({"psi": -0.1}), r"noise\['psi'\]: got -0.1, expected a standard deviation"),
        (Sensors({"psi": np.nan}), r"noise\['psi'\]: got nan, expected a finite number"),
        (Sensors({"psi": np.inf}), r"noise\['psi'\]: got inf, expected a finite number"),
        (Sensors(measured=("psi", "gps")), "measured: got 'gps', expected one of p_x"),
        (Sensors(late={"psy": 1}), r"late: got 'psy', .* Did you mean 'psi'\?"),
        (Sensors(age={"psy": 0.1}), r"age: got 'psy', .* Did you mean 'psi'\?"),
        (Sensors(age={"psi": np.inf}), r"age\['psi'\]: got inf, expected a finite number"),
        (Sensors(late={"psi": 1}, age={"psi": 0.1}), r"age\['psi'\]: got 0.1 s, expected nothing: late says it"),
        (Sensors(late={"psi": -1}), r"late\['psi'\]: got -1, expected a number of at least 0"),
    ],
)
def test_settings_are_checked(sensors, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        sensors.signals(PLANT, MODEL)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Sensors(measured="angle"),
        lambda: Missing(range(3), "angle"),
        lambda: Following(SinePath(), position="angle"),
        lambda: PaperStudy("angle"),
        lambda: Unfiltered().start(pendulum(), "angle"),
        lambda: ExtendedKalman({"angle": 0.1}, {"angle": 0.1, "rate": 0.1}).start(pendulum(), "angle"),
    ],
)
def test_one_name_is_no_list_of_names(make):
    with pytest.raises(rumo.ArgumentError, match=r": got 'angle', expected a tuple of names. Write \('angle',\)\."):
        make()


def test_missing_plant_output_is_named():
    blind = rumo.Model(
        states={"angle": "rad"}, inputs={"torque": "N m"}, dynamics=lambda x, u, p: {"angle": u.torque}, name="blind"
    )
    model = rumo.Model(
        states={"angle": "rad", "rate": "rad/s"},
        inputs={"torque": "N m"},
        dynamics=lambda x, u, p: {"angle": x.rate, "rate": u.torque},
    )
    with pytest.raises(rumo.UnknownNameError, match=r"got 'rate', expected one of angle\. Give blind an output"):
        Sensors().signals(as_plant(blind, 0.1), model)
