"""Without constraints and on a linear model the controller is the linear-quadratic regulator."""

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

import rumo
from rumo.controllers import QpOptions

ZERO = {"a": 0.0, "b": 0.0, "c": 0.0}
EXACT = QpOptions(tolerance=1e-13)
F = np.array([[0.0, 1.0, 0.0], [-0.4, -0.2, 1.0], [0.0, 0.0, -50.0]])
G = np.array([[0.0, 0.0], [0.0, 1.0], [50.0, 0.0]])
DT = 0.1


def problem(horizon, delay=0):
    model = rumo.Model(
        states={"a": "1", "b": "1", "c": "1"},
        inputs={"fast": "1", "slow": "1"},
        dynamics=lambda x, u, p: {
            name: sum(F[i, j] * x[other] for j, other in enumerate("abc")) + G[i, 0] * u.fast + G[i, 1] * u.slow
            for i, name in enumerate("abc")
        },
    )
    return rumo.Problem(
        model,
        horizon=horizon,
        sampling_time=DT,
        delay=delay,
        track={"a": rumo.Weight(2.0, range=0.5), "b": rumo.Weight(0.1), "c": rumo.Weight(0.2)},
        moves={"fast": rumo.Weight(0.3, range=2.0), "slow": rumo.Weight(0.05)},
    )


def augmented():
    """Implicit Euler with the previous input as part of the state; the control is the increment."""
    A = np.linalg.inv(np.eye(3) - DT * F)
    B = A @ (DT * G)
    A_aug = np.block([[A, B], [np.zeros((2, 3)), np.eye(2)]])
    B_aug = np.vstack([B, np.eye(2)])
    Q = np.diag([2.0 / 0.25, 0.1, 0.2, 0.0, 0.0])
    R = np.diag([0.3 / 4.0, 0.05])
    return A_aug, B_aug, Q, R


@pytest.mark.parametrize("horizon", [1, 7, 40])
def test_plan_equals_the_finite_horizon_riccati_recursion(horizon):
    A, B, Q, R = augmented()
    gains, P = [], Q
    for _ in range(horizon):
        gains.append(np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A))
        P = Q + A.T @ P @ (A - B @ gains[-1])
    state = np.array([1.0, -0.5, 0.3, 0.2, -0.1])
    expected = []
    for gain in reversed(gains):
        state = A @ state - B @ (gain @ state)
        expected.append(state.copy())

    controller = rumo.RealTimeIteration(problem(horizon), qp=EXACT)
    controller.reset(applied=[0.2, -0.1])
    plan = controller.step([1.0, -0.5, 0.3], ZERO)
    np.testing.assert_allclose(plan.x.values[1:], np.array(expected)[:, :3], rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(plan.u.values, np.array(expected)[:, 3:], rtol=1e-8, atol=1e-10)


def test_a_long_horizon_gives_the_infinite_horizon_gain():
    A, B, Q, R = augmented()
    # The regulator's cost counts x_0, ours starts at x_1: the same minimiser.
    P = solve_discrete_are(A, B, Q, R)
    gain = np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A)
    controller = rumo.RealTimeIteration(problem(horizon=200), qp=EXACT)
    controller.reset(applied=[0.2, -0.1])
    plan = controller.step([1.0, -0.5, 0.3], ZERO)
    move = -gain @ np.array([1.0, -0.5, 0.3, 0.2, -0.1])
    np.testing.assert_allclose(plan.command.values, np.array([0.2, -0.1]) + move, rtol=1e-7)


def test_delay_is_the_same_problem_from_the_predicted_state():
    delayed = rumo.RealTimeIteration(problem(horizon=12, delay=2), qp=EXACT)
    applied = np.array([[0.4, 0.1], [-0.3, 0.2]])
    delayed.reset(applied=applied)
    plan = delayed.step([1.0, -0.5, 0.3], ZERO)

    x = np.array([1.0, -0.5, 0.3])
    for u in applied:
        x = np.linalg.solve(np.eye(3) - DT * F, x + DT * G @ u)
    direct = rumo.RealTimeIteration(problem(horizon=10), qp=EXACT)
    direct.reset(applied=applied[-1])
    np.testing.assert_allclose(plan.command.values, direct.step(x, ZERO).command.values, rtol=1e-8, atol=1e-10)
