"""acados in a loop in C: what it is told, sample by sample; and that it solves the problem that is ours."""

import ctypes
from types import SimpleNamespace

import numpy as np
import pytest

from rumo.bench import record
from rumo.bench.acados import AcadosRti, available
from rumo.bench.acados.driver import FUNCTIONS, POINTERS, Target, replay
from rumo.bench.acados.statement import Statement
from rumo.controllers.engines.stagewise import eliminate
from rumo.transcription import Transcription

N, STATES, INPUTS, OUTPUTS, MEMORY, TOLD = 4, 2, 1, 2, 2, 1
WIDTH = STATES + MEMORY * INPUTS
STEP = 0.5
POINTER, NUMBER, TEXT = ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p


class Fake:
    """A solver behind acados' functions: it writes down what it is told, and what it finds are random numbers."""

    def __init__(self, qp_status=0):
        self.calls, self.found, self.phase, self.qp_status = [], [], 0, qp_status
        self._rng = np.random.default_rng(1)
        self._table = (ctypes.c_double * 8)(*range(8))  # of two iterations with four columns
        self._table[4] = qp_status
        signatures = {
            "set_all": (None, POINTER, POINTER, POINTER, TEXT, POINTER),
            "get_all": (None, POINTER, POINTER, POINTER, TEXT, POINTER),
            "set_guess": (None, POINTER, NUMBER, TEXT, POINTER),
            "set_option": (None, POINTER, POINTER, TEXT, POINTER),
            "set_cost": (NUMBER, POINTER, POINTER, POINTER, NUMBER, TEXT, POINTER),
            "set_limits": (NUMBER, POINTER, POINTER, POINTER, POINTER, NUMBER, TEXT, POINTER),
            "get": (None, POINTER, TEXT, POINTER),
            "get_at": (None, POINTER, POINTER, POINTER, NUMBER, TEXT, POINTER),
            "solve": (NUMBER, POINTER),
        }
        self._kept = {name: ctypes.CFUNCTYPE(*kinds)(getattr(self, name)) for name, kinds in signatures.items()}

    def target(self, guess):
        return Target(
            horizon=N,
            states=STATES,
            inputs=INPUTS,
            outputs=OUTPUTS,
            memory=MEMORY,
            told=TOLD,
            guess=guess,
            sampling_time=STEP,
            **dict.fromkeys(POINTERS),
            **{name: ctypes.cast(function, POINTER) for name, function in self._kept.items()},
        )

    def _told(self, name, address, *shape):
        size = int(np.prod(shape))
        self.calls.append(
            (name, np.ctypeslib.as_array((ctypes.c_double * size).from_address(address)).reshape(shape).copy())
        )

    def set_all(self, solver, given, out, field, value):
        shape = {b"x": (N + 1, WIDTH), b"u": (N, INPUTS), b"p": (N + 1, STATES)}[field]
        self._told(field.decode(), value, *shape)

    def get_all(self, solver, given, out, field, value):
        found = self.found[-1][field == b"u"]
        ctypes.memmove(value, found.ctypes.data, found.nbytes)

    def set_guess(self, solver, stage, field, value):
        self._told(f"{field.decode()} {stage}", value, WIDTH)

    def set_option(self, config, options, field, value):
        assert field == b"rti_phase"
        self.phase = ctypes.c_int.from_address(value).value
        self.calls.append(("phase", self.phase))

    def set_cost(self, config, dims, given, stage, field, value):
        size = OUTPUTS + (INPUTS if stage < N else 0)
        self._told(f"{field.decode()} {stage}", value, size)
        return 0

    def set_limits(self, config, dims, given, out, stage, field, value):
        assert stage == 0
        self._told(field.decode(), value, WIDTH)
        return 0

    def get(self, solver, field, value):
        if field == b"stat":
            ctypes.c_void_p.from_address(value).value = ctypes.addressof(self._table)
        else:
            ctypes.c_int.from_address(value).value = {b"stat_n": 4, b"nlp_iter": 1}[field]

    def get_at(self, config, dims, out, stage, field, value):
        assert (stage, field) == (0, b"u")
        ctypes.c_double.from_address(value).value = self.found[-1][1][0, 0]

    def solve(self, capsule):
        if self.phase == 2:
            self.found.append((self._rng.normal(size=(N + 1, WIDTH)), self._rng.normal(size=(N, INPUTS))))
        return 7 if self.phase == 2 and len(self.found) == 3 else 0


@pytest.fixture(params=[0, 1, 2], ids=["keeps its guess", "slopes", "end states"])
def replayed(request):
    """Three samples, of which acados fails on the last."""
    rng, fake = np.random.default_rng(0), Fake(qp_status=2)
    drive = {
        "x": rng.normal(size=(3, STATES)),
        "reference": rng.normal(size=(3, N + 1, OUTPUTS)),
        "applied": rng.normal(size=(3, TOLD, INPUTS)),
    }
    begin = rng.normal(size=(N + 1, WIDTH)), rng.normal(size=(N, INPUTS))
    offset, decided = np.array([10.0, 20.0]), np.array([[0.25], [0.5]])
    result = replay(fake.target(request.param), drive, offset, begin, decided)
    return SimpleNamespace(fake=fake, drive=drive, begin=begin, offset=offset, result=result, guess=request.param)


def test_each_sample_is_told_in_order(replayed):
    guesses = {0: [], 1: [f"xdot_guess {k}" for k in range(N)], 2: ["p"]}[replayed.guess]
    wanted = [f"yref {k}" for k in range(1, N + 1)]
    sample = ["x", "u", *guesses, *wanted, "phase", "lbx", "ubx", "phase"]
    assert [name for name, _ in replayed.fake.calls] == 3 * sample
    assert [value for name, value in replayed.fake.calls if name == "phase"] == 3 * [1, 2]


def test_the_guess_is_the_last_solution_a_sample_later(replayed):
    xs, us = ([value for name, value in replayed.fake.calls if name == field] for field in ("x", "u"))
    np.testing.assert_array_equal(xs[0], replayed.begin[0])
    np.testing.assert_array_equal(us[0], replayed.begin[1])
    for (x_found, u_found), x, u in zip(replayed.fake.found, xs[1:], us[1:], strict=False):
        np.testing.assert_array_equal(u[:, 0], [*u_found[1:, 0], u_found[-1, 0]])
        np.testing.assert_array_equal(x[:-1], x_found[1:])
        np.testing.assert_allclose(x[-1, :STATES], 2.0 * x_found[-1, :STATES] - x_found[-2, :STATES], atol=1e-15)
        # The inputs in the last state are the one decided before it and the one held in it.
        np.testing.assert_array_equal(x[-1, STATES:], [x_found[-1, -1], u_found[-1, 0]])
    for name, value in replayed.fake.calls:
        if name == "p":
            np.testing.assert_array_equal(value, np.vstack([xs[0][1:, :STATES], xs[0][-1:, :STATES]]))
            break
        if name.startswith("xdot_guess"):
            k = int(name.split()[1])
            np.testing.assert_allclose(value, (xs[0][k + 1] - xs[0][k]) / STEP, rtol=1e-14)
            if k == N - 1:
                break


def test_references_and_measurements_are_the_samples(replayed):
    told = replayed.fake.calls
    for k in range(1, N + 1):
        values = [value[:OUTPUTS] for name, value in told if name == f"yref {k}"]
        np.testing.assert_array_equal(values, replayed.drive["reference"][:, k] - replayed.offset)
    moves = [value[OUTPUTS:] for name, value in told if name.startswith("yref") and not name.endswith(str(N))]
    assert not np.any(moves)
    lower, upper = ([value for name, value in told if name == side] for side in ("lbx", "ubx"))
    np.testing.assert_array_equal(lower, upper)
    np.testing.assert_array_equal(np.array(lower)[:, :STATES], replayed.drive["x"])
    # The newer of the two decided inputs is told; the older is what was told a sample before, first the safe one.
    applied, commands = replayed.drive["applied"][:, 0, 0], replayed.result.commands[:, 0]
    np.testing.assert_array_equal(np.array(lower)[:, -1], applied)
    np.testing.assert_array_equal(np.array(lower)[:, -2], [0.25, applied[0], applied[1]])
    np.testing.assert_array_equal(commands, [u[0, 0] for _, u in replayed.fake.found])


def test_a_status_is_that_of_acados_or_of_its_qp(replayed):
    np.testing.assert_array_equal(replayed.result.statuses, [2, 2, 7])
    assert (replayed.result.times >= 0.0).all()


@pytest.fixture(scope="module")
def recording():
    return record("limit", 10, 60)


def test_the_statement_has_the_stages_of_the_transcription(recording):
    """Next state, derivatives, cost and constraints of a stage, from one Newton step about a guess."""
    import casadi as ca

    problem, rng = recording.problem, np.random.default_rng(2)
    ocp = SimpleNamespace(model=SimpleNamespace(), cost=SimpleNamespace(), constraints=SimpleNamespace())
    statement = Statement(problem, 1e10)
    statement.write(ocp, "DISCRETE")
    model, nx, nu = ocp.model, len(problem.model.states), len(problem.model.inputs)
    x = recording.x[20] + 1e-2 * rng.normal(size=(problem.horizon + 1, nx))
    u = rng.uniform(-0.5, 0.5, (problem.horizon, nu)) * problem.input_scales
    transcription = Transcription(problem)
    stages = transcription.linearize(x, u, np.zeros((problem.horizon, 0)), problem.parameters)
    A, B, c = eliminate(stages)
    of_model = ca.Function(
        "stage", [model.x, model.u, model.p], [model.disc_dyn_expr, model.disc_dyn_custom_jac_ux_expr]
    )
    # Delay 1: what acts in a stage is the input that its state holds.
    state, new = np.r_[x[3], u[3] / problem.input_scales], rng.normal(size=nu)
    after, jacobian = (value.full() for value in of_model(state, new, x[4]))
    np.testing.assert_allclose(after[:nx, 0], x[4] + c[3], atol=1e-9)
    np.testing.assert_array_equal(after[nx:, 0], new)
    np.testing.assert_allclose(jacobian[:nx, nu : nu + nx], A[3], atol=1e-9)
    np.testing.assert_allclose(jacobian[:nx, nu + nx :], B[3] * problem.input_scales, atol=1e-9)

    residual = ocp.cost.Vx @ state + ocp.cost.Vu @ new + np.r_[statement.offset, np.zeros(nu)]
    np.testing.assert_allclose(residual, np.r_[stages.y[2], new - state[nx:]], atol=1e-12)
    move = problem.move_weights[-1] * problem.input_scales**2
    np.testing.assert_allclose(np.diag(ocp.cost.W)[-nu:], 2.0 * move)
    rows = ca.Function("rows", [model.x], [model.con_h_expr])(state).full()[:, 0]
    np.testing.assert_allclose(rows, stages.G[2][statement.nonlinear], rtol=1e-9)


@pytest.mark.skipif(not available(), reason="acados is installed apart from the package")
@pytest.mark.parametrize(
    ("solver", "far"),
    [
        ("FULL_CONDENSING_DAQP", 1e-8),
        ("PARTIAL_CONDENSING_HPIPM", 1e-4),
    ],  # whose fastest mode stops beside the solution
)
def test_acados_finds_the_commands_of_the_drive(recording, solver, far):
    controller = AcadosRti(recording.problem, solver, "DISCRETE", block=2)
    result = controller.replay(recording)
    assert not result.statuses.any()
    driven = recording.applied[1:, 0] / recording.problem.input_scales
    np.testing.assert_allclose(result.commands[10:-1], driven[10:], rtol=0.0, atol=far)


def test_functions_that_are_called_have_a_place():
    assert {name for name, _ in Target._fields_} >= {*POINTERS, *FUNCTIONS, "solve"}
