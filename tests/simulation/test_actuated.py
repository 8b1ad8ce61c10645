"""Dead times, lags and limits of rate before a plant, held to closed forms and to plants that have them as states."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from problems import pendulum
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from test_foreign import Simulator

import rumo
from rumo.actuation import acting_inputs
from rumo.signals import Signals
from rumo.simulation import ClosedLoop, Scenario, channel, faults, load, save
from rumo.simulation.actuated import ActuatedInputs, mean_input
from rumo.simulation.channel import Channel

DT = 0.05
A, B = np.array([[0.0, 1.0], [-9.81, 0.0]]), np.array([0.0, 1.0])  # the pendulum of `problems`
STIFF = rumo.Settings(gate=None)


def run(delay, actuation, plant=None, duration=2.0, **changes):
    problem = pendulum(delay=delay)
    x = [0.3, 0.0] if plant is None else [0.3] + [0.0] * (len(plant.states) - 1)
    return Scenario(
        problem, plant or problem.model, x, {"angle": 0.1}, duration, settings=STIFF, actuation=actuation, **changes
    ).run()


def exactly(model):
    return rumo.Plant(model, DT, tolerance=1e-12)


def torque(**actuator):
    return rumo.Actuation({"torque": rumo.Actuator(**actuator)})


def state(log):
    return log["plant"].sel(plant_state=["angle", "rate"]).to_numpy()


@settings(max_examples=60, deadline=None)
@given(
    st.floats(0.005, 0.5),
    st.one_of(st.just(np.inf), st.floats(0.1, 20.0)),
    st.floats(-1.0, 1.0),
    st.floats(-1.0, 1.0),
    st.floats(0.01, 0.5),
)
def test_a_channel_is_the_solution_of_its_equation(lag, rate, start, command, duration):
    one = Channel(rumo.Actuator(lag, rate), start)
    mean = one.go(command, duration)

    def equation(t, y):
        return [np.clip((command - y[0]) / lag, -rate, rate), y[0]]

    exact = solve_ivp(equation, (0.0, duration), [start, 0.0], rtol=1e-9, atol=1e-11, method="LSODA").y[:, -1]
    assert one.value == pytest.approx(exact[0], abs=2e-6)
    assert mean * duration == pytest.approx(exact[1], abs=2e-6)


def test_a_limit_of_rate_alone_goes_straight():
    one = Channel(rumo.Actuator(rate=2.0), 0.0)
    assert one.go(1.0, 0.25) == pytest.approx(0.25)
    assert one.value == pytest.approx(0.5)
    assert one.go(1.0, 1.0) == pytest.approx(0.25 * 0.75 + 0.75)
    assert one.value == 1.0


@settings(max_examples=60, deadline=None)
@given(st.floats(0.0, 3.0), st.floats(0.0, 3.0), st.integers(0, 1000))
def test_dead_times_are_those_of_each_channel(first, second, seed):
    """Means over samples, by interpolation of the sum of commands at shifted times."""
    inputs = Signals({"a": "1", "b": "1"}, "inputs")
    late = {"a": first, "b": second}
    actuation = rumo.Actuation({name: rumo.Actuator(dead_time=DT * samples) for name, samples in late.items()})
    acting = acting_inputs(actuation, inputs, DT)
    inputs_of = ActuatedInputs(actuation, acting, inputs, DT, np.zeros(2))
    commands = np.random.default_rng(seed).normal(size=(12, 2))
    delayed = np.vstack([np.zeros((acting.delay, 2)), commands])[:12]
    means = np.array([mean_input(inputs_of.over(row)) for row in delayed])
    times = np.arange(13.0)
    for j, samples in enumerate(late.values()):
        area = np.concatenate([[0.0], np.cumsum(commands[:, j])])
        expected = np.diff(np.interp(times - samples, times, area, left=0.0))
        np.testing.assert_allclose(means[:, j], expected, atol=1e-5)


def test_a_dead_time_ends_where_it_ends():
    """The linear pendulum by matrix exponentials, its input changing within samples."""
    T = 0.67 * DT
    log = run(0, torque(dead_time=T), exactly(pendulum().model), believed=rumo.Actuation())
    system = np.zeros((3, 3))
    system[:2, :2], system[:2, 2] = A, B
    commands = np.concatenate([[0.0], log["commanded"].to_numpy()[:, 0]])
    x = np.array([0.3, 0.0])
    for k, found in enumerate(state(log)):
        np.testing.assert_allclose(found, x, atol=1e-8)
        for u, part in ((commands[k], T), (commands[k + 1], DT - T)):
            x = (expm(system * part) @ np.append(x, u))[:2]
    assert np.abs(np.diff(commands)).max() > 0.2


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_whole_samples_are_a_problems_delay(delay):
    """To the last bit, as computation or as dead time."""
    ours = run(delay, None)
    for actuation in (rumo.Actuation(computation=delay * DT), torque(dead_time=delay * DT)):
        log = run(delay, actuation)
        for name in ("plant", "applied", "commanded", "estimated", "predicted_states"):
            np.testing.assert_array_equal(log[name], ours[name])
        np.testing.assert_array_equal(log["actuated"], log["applied"])
    assert "actuated" not in ours


def test_a_lag_is_that_of_a_plant_with_a_lag(monkeypatch):
    """Whose error is of second order in the pieces."""
    lagging = torque(lag=0.08)
    plant = rumo.with_actuators(pendulum().model, lagging)
    exact, errors = state(run(0, None, exactly(plant))), []
    for pieces in (4, 8, 16):
        monkeypatch.setattr(channel, "RESOLUTION", pieces)
        log = run(0, lagging, exactly(pendulum().model), believed=rumo.Actuation())
        errors.append(np.abs(state(log) - exact).max())
    assert errors[1] < 1e-4
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.25)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.25)


def test_a_limit_of_rate_is_that_of_what_the_log_says():
    log = run(1, rumo.Actuation({"torque": rumo.Actuator(rate=3.0)}, computation=DT))
    steps = np.diff(log["actuated"].to_numpy()[:, 0])
    assert np.abs(steps).max() <= 3.0 * DT + 1e-12
    assert np.abs(np.diff(log["applied"].to_numpy()[:, 0])).max() > 3.0 * DT


def test_channels_have_times_of_their_own():
    """Two inputs that are the same but for when they act."""
    model = rumo.Model(
        {"a": "m", "b": "m"},
        {"early": "m/s", "late": "m/s"},
        lambda x, u, p: {"a": u.early - x.a, "b": u.late - x.b},
    )
    weight = rumo.Weight(1.0)
    problem = rumo.Problem(
        model,
        horizon=8,
        sampling_time=DT,
        track={"a": weight, "b": weight},
        moves={"early": weight, "late": weight},
        delay=1,
    )
    actuation = rumo.Actuation({"late": rumo.Actuator(dead_time=2.0 * DT)}, computation=DT)
    log = Scenario(problem, model, [1.0, 1.0], {"a": 0.0, "b": 0.0}, 1.0, actuation=actuation).run()
    given = log["actuated"].to_numpy()
    commanded = log["commanded"].to_numpy()
    np.testing.assert_array_equal(given[1:, 0], commanded[:-1, 0])
    np.testing.assert_array_equal(given[3:, 1], commanded[:-3, 1])


def test_faults_are_of_what_actuators_are_told():
    stuck = faults.Stuck(range(10, 20), "torque", value=1.0)
    log = run(0, torque(lag=0.1), believed=rumo.Actuation(), faults=(stuck,))
    np.testing.assert_array_equal(log["applied"].to_numpy()[10:20], 1.0)
    given = log["actuated"].to_numpy()[10:20, 0]
    left = 1.0 - given
    np.testing.assert_allclose(left[1:] / left[:-1], np.exp(-DT / 0.1))


def test_commands_of_others_take_the_same_way():
    problem = pendulum(delay=0)
    scenario = Scenario(problem, problem.model, [0.3, 0.0], {"angle": 0.1}, 0.5, actuation=torque(dead_time=0.02))
    moments = ClosedLoop(scenario).moments()
    given = [moments.send(np.array([float(moment.index)])).actuated["torque"] for moment in moments]
    k = np.arange(10)
    np.testing.assert_allclose(given, k - 0.4 * (k > 0))


def test_a_log_keeps_what_actuators_did(tmp_path):
    log = run(0, torque(dead_time=0.02))
    save(log, tmp_path / "log.nc")
    again = load(tmp_path / "log.nc")
    np.testing.assert_array_equal(again["actuated"], log["actuated"])
    assert again.attrs["lead_s"] == pytest.approx(0.02)


class Divisible(Simulator):
    def advance(self, x, u, p, duration=None):
        return self.plant.advance(x, u[1:], p, duration)


def test_plants_of_others_go_on_by_parts():
    late = torque(dead_time=0.02, lag=0.03)
    theirs, ours = run(0, late, Divisible()), run(0, late)
    np.testing.assert_array_equal(theirs["plant"], ours["plant"])
    with pytest.raises(rumo.ArgumentError, match=r"plant: got theirs, which goes on by whole samples"):
        run(0, late, Simulator())
    np.testing.assert_array_equal(run(1, torque(dead_time=DT), Simulator())["plant"], run(1, None)["plant"])


def test_a_plant_in_parts_is_the_plant():
    plant = rumo.Plant(pendulum().model, DT)
    x, u, p = np.array([0.3, -0.2]), np.array([0.5]), np.array([9.81])
    half = plant.advance(plant.advance(x, u, p, 0.3 * DT), u, p, 0.7 * DT)
    np.testing.assert_allclose(half, plant.advance(x, u, p), atol=1e-7)


def test_misuse():
    with pytest.raises(rumo.ArgumentError, match=r"problem.delay: got 0, expected 2: computation of 0.06 s"):
        run(0, rumo.Actuation({"torque": rumo.Actuator(dead_time=0.05)}, computation=0.06))
    with pytest.raises(rumo.ArgumentError, match=r"problem.delay: got 1, expected 0"):
        run(1, torque(lag=0.1))
    with pytest.raises(rumo.UnknownNameError, match=r"actuation: got 'force'"):
        run(0, rumo.Actuation({"force": rumo.Actuator()}))
    with pytest.raises(rumo.UnknownNameError, match=r"believed: got 'force'"):
        run(0, None, believed=rumo.Actuation({"force": rumo.Actuator()}))
    with pytest.raises(rumo.ArgumentError, match=r"actuation: got Actuator.*expected a rumo.Actuation"):
        run(0, rumo.Actuator())
