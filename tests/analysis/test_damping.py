import warnings

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

import rumo
from rumo.analysis import damping
from rumo.studies.paper import CLOSE_WEIGHTS
from rumo.vehicles import PASSENGER_CAR, dynamic_bicycle


def oscillator(rate=3.0, ratio=0.05, **options):
    def dynamics(x, u, p):
        return {"y": x.v, "v": -(rate**2) * x.y - 2.0 * ratio * rate * x.v + u.force}

    model = rumo.Model({"y": "m", "v": "m/s"}, {"force": "N"}, dynamics, name="oscillator")
    given = {"track": {"y": rumo.Weight(1.0)}, "moves": {"force": rumo.Weight(0.1)}, "horizon": 20, **options}
    return rumo.Problem(model, sampling_time=0.1, **given)


def car(speed, **options):
    problem = rumo.Problem(
        dynamic_bicycle(PASSENGER_CAR),
        horizon=25,
        sampling_time=0.04,
        track=CLOSE_WEIGHTS,
        moves={"torque": rumo.Weight(5.0, 1500.0), "steering_rate": rumo.Weight(5.0, 3.0)},
        delay=1,
        **options,
    )
    turning = speed / PASSENGER_CAR.r
    return problem, {**dict.fromkeys(problem.model.states, 0.0), "v_x": speed, "w_f": turning, "w_r": turning}


def test_over_a_long_horizon_it_is_that_of_the_linear_quadratic_regulator():
    # x and the last input, by zero-order hold; the cost of a horizon that never ends.
    problem = oscillator(horizon=400)
    exact = rumo.Radau3(substeps=4)
    _, A, B = rumo.transcription.Transcription(problem, exact).response(np.zeros(2), np.zeros(1))
    A, B = A[:2], B[:2]
    F, G = np.block([[A, B], [np.zeros((1, 2)), np.eye(1)]]), np.vstack([B, np.eye(1)])
    Q, R = np.diag([1.0, 0.0, 0.0]), np.array([[0.1]])
    Q_now = F.T @ Q @ F  # the cost counts the next state, not this one
    N = F.T @ Q @ G
    P = solve_discrete_are(F, G, Q_now, R + G.T @ Q @ G, s=N)
    K = np.linalg.solve(R + G.T @ Q @ G + G.T @ P @ G, G.T @ P @ F + N.T)
    rates = np.log(np.linalg.eigvals(F - G @ K).astype(complex)) / 0.1
    found = damping(problem, exact, [0.0, 0.0], [0.0])
    assert found.ratio == pytest.approx((-rates.real / np.abs(rates)).min(), rel=1e-6)
    assert found.exact == found.ratio


@pytest.mark.parametrize("delay", [0, 1, 3])
@pytest.mark.parametrize("blocks", [None, rumo.InputBlocks, rumo.IncrementBlocks])
@pytest.mark.parametrize("scheme", [rumo.ImplicitEuler(), rumo.Radau2()])
def test_a_loop_decays_as_it_says(scheme, blocks, delay):
    # The slowest mode of a drive is what is left after a while.
    lengths = [1, 1, 2, 4, 12 - delay]
    problem = oscillator(delay=delay, blocks=blocks and blocks(lengths))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = damping(problem, scheme, [0.0, 0.0], [0.0])
    controller = rumo.RealTimeIteration(problem, scheme, backend="portable")
    log = rumo.simulate(controller, rumo.Plant(problem.model, 0.1, 1e-12), [1.0, 0.0], {"y": 0.0}, 12.0)
    size = np.hypot(*log["plant"].to_numpy().T)
    begin, end = 20, 110
    assert (size[end - 20 : end].max() / size[begin - 20 : begin].max()) ** (1 / (end - begin)) == pytest.approx(
        found.radius, rel=0.01
    )


def test_euler_takes_damping_from_a_car():
    problem, x = car(50.0)
    with pytest.warns(rumo.PoorDampingWarning, match=r"0\.11, at .* by ImplicitEuler, and 0\.32 by an exact"):
        euler = damping(problem, rumo.ImplicitEuler(), x, [0.0, 0.0])
    radau = damping(problem, rumo.Radau2(), x, [0.0, 0.0])
    assert radau.ratio == pytest.approx(radau.exact, rel=0.02)
    assert euler.exact == radau.exact


def test_weights_can_leave_too_little_as_well():
    with pytest.warns(rumo.PoorDampingWarning, match="Weigh rates more"):
        damping(oscillator(moves={"force": rumo.Weight(100.0)}), rumo.Radau3(), [0.0, 0.0], [0.0])


def test_a_state_that_nothing_moves_is_left_out():
    problem, x = car(30.0)
    still = {**CLOSE_WEIGHTS}
    del still["p_x"]
    free = rumo.Problem(
        problem.model,
        horizon=25,
        sampling_time=0.04,
        track=still,
        moves={"torque": rumo.Weight(5.0, 1500.0), "steering_rate": rumo.Weight(5.0, 3.0)},
        delay=1,
    )
    assert damping(free, rumo.Radau2(), x, [0.0, 0.0]).ratio > 0.1


def test_a_point_of_another_problem_is_refused():
    problem = oscillator()
    with pytest.raises(rumo.ArgumentError, match="x"):
        damping(problem, rumo.Radau2(), {"y": 0.0}, [0.0])
    with pytest.raises(rumo.ShapeError, match="u"):
        damping(problem, rumo.Radau2(), [0.0, 0.0], [0.0, 1.0])
