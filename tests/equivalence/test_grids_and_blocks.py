"""Non-uniform grids, held inputs and increments, parameters that vary: all backends alike, and IPOPT's solution."""

import numpy as np
import pytest
from problems import BACKENDS, EXACT, car, made_with
from test_backends import assert_same, compare, drive, of_chain, of_rod

import rumo
from rumo.controllers import NlpSettings
from rumo.controllers.engines.described import guard_of
from rumo.controllers.engines.trajectory import Trajectory
from rumo.shift import Shift
from rumo.status import Status
from rumo.studies import PaperStudy
from rumo.transcription import Transcription

REFERENCE = {"p_x": 0.0, "p_y": 0.3, "psi": 0.1, "v_x": 8.3}


def growing(intervals, delay, ratio=1.2):
    return rumo.Grid.geometric(intervals, 0.04, ratio, equal=delay + 1)


# Grid or number of intervals, blocks, delay.
CASES = {
    "uniform": (15, None, 1),
    "growing": (growing(12, 1), None, 1),
    "growing_without_delay": (growing(10, 0), None, 0),
    "any_lengths": (rumo.Grid([0.04, 0.04, 0.1, 0.05, 0.2, 0.03]), None, 1),
    "held_inputs": (15, rumo.InputBlocks([1, 1, 2, 4, 6]), 1),
    "one_input": (8, rumo.InputBlocks([6]), 2),
    "held_increments": (15, rumo.IncrementBlocks([1, 1, 2, 4, 6]), 1),
    "ramps_from_the_start": (15, rumo.IncrementBlocks([3, 2, 4, 6]), 0),
    "all_at_once": (growing(12, 1), rumo.IncrementBlocks([2, 3, 6]), 1),
}
SCHEMES = {"implicit-euler": rumo.ImplicitEuler(), "radau2": rumo.Radau2(), "2 bdf2": rumo.Bdf2(substeps=2)}
every_case = pytest.mark.parametrize("case", CASES)
every_scheme = pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)


def problem_of(case):
    horizon, blocks, delay = CASES[case]
    study = PaperStudy(delay=delay)
    settings = study.problem()
    N = horizon if isinstance(horizon, int) else len(horizon.steps)
    return rumo.Problem(
        settings.model,
        horizon=horizon,
        sampling_time=0.04,
        delay=delay,
        track={"p_x": rumo.Weight(1.0, 160.0), "p_y": rumo.Weight(1.0, 6.0), "psi": rumo.Weight(1.0, 0.6)}
        | {"v_x": rumo.Weight(1.0, 10.0)},
        moves={"torque": rumo.Weight(5.0, range=600.0), "steering_rate": rumo.Weight(5.0, range=3.0)},
        bounds={"torque": (-300.0, 300.0), "steering_rate": (-0.4, 1.5)},
        move_bounds={"torque": (-50.0, 50.0), "steering_rate": (-0.3, 0.2)},
        parameters={"wind_speed": np.linspace(0.0, 5.0, N)},
        blocks=blocks,
    )


def start():
    return car()[1]


@every_scheme
@every_case
def test_portable_equals_reference(case, scheme):
    problem = problem_of(case)
    controllers = [made_with(problem, backend, scheme) for backend in BACKENDS]
    for first, *others in drive(controllers, problem, start(), REFERENCE, samples=8):
        assert first.status.solved
        for other in others:
            assert_same(problem, first, other, 1e-7)


def test_ramps_along_a_limit():
    """At all of its intervals, so that more limits hold than there are inputs to move."""
    problem, x, wanted = of_rod(100, 0, None, blocks=rumo.IncrementBlocks([4, 4, 5, 5, 2] * 5))
    controllers = [made_with(problem, backend) for backend in BACKENDS]
    for first, *others in drive(controllers, problem, x, wanted, samples=4):
        assert first.status.solved
        assert (first.u.values > 0.0).any()
        for other in others:
            assert_same(problem, first, other, 1e-8)


def test_inputs_that_hardly_reach_states():
    """One interval is left, in which a force on the first of twelve masses does next to nothing to the last."""
    compare(of_chain, 15, 14, None, BACKENDS, 1e-8, rumo.Radau2())


@pytest.mark.slow
@pytest.mark.parametrize("case", ["all_at_once", "growing", "held_inputs"])
def test_tailored_equals_portable(case, kept_builds):
    problem = problem_of(case)
    controllers = [
        rumo.RealTimeIteration(problem, rumo.Radau2(), qp=EXACT, backend=b) for b in ("portable", "tailored")
    ]
    for first, second in drive(controllers, problem, start(), REFERENCE, samples=8):
        assert_same(problem, first, second, 1e-9)


@every_scheme
@every_case
def test_converged_it_is_the_nlp_solution(case, scheme):
    problem = problem_of(case)
    rti = rumo.RealTimeIteration(problem, scheme, sqp_iterations=50, tolerance=1e-12, qp=EXACT)
    nlp = rumo.DirectNlp(problem, scheme, settings=NlpSettings(tolerance=1e-11))
    ours, oracle = (controller.step(start(), REFERENCE) for controller in (rti, nlp))
    np.testing.assert_allclose(ours.u.values, oracle.u.values, rtol=0.0, atol=1e-6 * problem.input_scales.max())
    np.testing.assert_allclose(ours.x.values, oracle.x.values, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("make", [rumo.RealTimeIteration, rumo.DirectNlp], ids=["rti", "nlp"])
def test_held_inputs_are_held_and_ramps_are_straight(make):
    plan = make(problem_of("held_inputs")).step(start(), REFERENCE)
    np.testing.assert_allclose(np.diff(plan.u.values[1:], axis=0)[[2, 4, 5, 6]], 0.0, atol=1e-12)
    plan = make(problem_of("ramps_from_the_start")).step(start(), REFERENCE)
    u = np.vstack([np.zeros(2), plan.u.values])  # from the safe input, which a fresh controller believes was applied
    for first, last in ((0, 3), (3, 5), (5, 9), (9, 15)):
        straight = np.linspace(u[first], u[last], last - first + 1)
        np.testing.assert_allclose(u[first : last + 1], straight, atol=1e-10)


@every_case
def test_limits_hold_between_intervals(case):
    problem = problem_of(case)
    controller = rumo.RealTimeIteration(problem)
    for _ in range(3):
        before = controller.applied[-1]
        plan = controller.step(start(), REFERENCE | {"p_y": -3.0, "v_x": 20.0})
        moves = np.diff(plan.u.values[problem.delay :], axis=0, prepend=before[None])
        assert plan.status.solved
        assert (moves <= problem.move_upper + 1e-9).all()
        assert (moves >= problem.move_lower - 1e-9).all()
        assert (plan.u.values >= problem.input_lower - 1e-9).all()


@pytest.mark.parametrize("case", ["growing", "any_lengths", "uniform"])
def test_shifting_what_is_straight_in_time_is_exact(case):
    transcription = Transcription(problem_of(case), rumo.Radau3(substeps=2))
    problem, guard = transcription.problem, guard_of(transcription, rumo.Settings())
    rates, base = np.arange(9.0), np.ones(9)

    def at(time):
        x = base + rates * (time + problem.times)[:, None]
        u = np.tile(np.array([1.0, 2.0]), (problem.horizon, 1))
        return Trajectory(u, x, transcription.inner_between(x[:-1], x[1:]))

    guard.applied = [[1.0, 2.0]]
    guard.follow(at(0.0).parts, Status.OPTIMAL)
    now, later = guard.next, at(problem.sampling_time)
    np.testing.assert_allclose(now.x, later.x, atol=1e-9)
    np.testing.assert_allclose(now.inner, later.inner, atol=1e-9)


@pytest.mark.parametrize("case", ["growing", "any_lengths"])
def test_inputs_of_later_intervals_are_those_at_the_same_time(case):
    problem = problem_of(case)
    shift, middle = Shift(Transcription(problem)), problem.times[:-1] + 0.5 * problem.steps
    for k, j in enumerate(shift.intervals):
        if j < problem.horizon - 1:
            assert problem.times[j] <= middle[k] + problem.sampling_time <= problem.times[j + 1]
    assert shift.intervals[problem.delay] == problem.delay + 1  # the next command


def test_an_error_counts_by_the_length_of_its_interval():
    problem = problem_of("any_lengths")
    np.testing.assert_allclose(problem.output_weights[:, 3], np.array([1.0, 1.0, 2.5, 1.25, 5.0, 0.75]) / 100.0)


@pytest.mark.parametrize("make", [rumo.RealTimeIteration, rumo.DirectNlp, rumo.LinearTimeVarying])
def test_parameters_are_used_from_the_next_preparation_on(make):
    problem, x, window = car()
    wind = {"wind_speed": np.linspace(0.0, 20.0, problem.horizon), "wind_direction": 1.5}
    settings = {
        "horizon": problem.horizon,
        "sampling_time": problem.sampling_time,
        "track": {name: rumo.Weight(1.0, 10.0) for name in problem.outputs},
        "moves": {"torque": rumo.Weight(5.0, range=600.0), "steering_rate": rumo.Weight(5.0, range=3.0)},
        "delay": 1,
    }
    calm, windy = rumo.Problem(problem.model, **settings), rumo.Problem(problem.model, **settings, parameters=wind)
    controller, expected = make(calm), make(windy).step(x, window)
    still = controller.step(x, window)
    controller.reset()
    controller.parameters = wind
    np.testing.assert_array_equal(controller.parameters, windy.parameters)
    np.testing.assert_allclose(controller.step(x, window).u.values, expected.u.values, rtol=1e-9, atol=1e-9)
    assert np.abs(still.u["torque"] - expected.u["torque"]).max() > 1e-3
    controller.prepare()
    controller.parameters = {"wind_speed": calm.parameters[:, problem.model.parameters.index("wind_speed")]}
    assert controller.feedback(x, window).status.solved  # what was prepared is prepared again
    # Those not named stay, also after a reset.
    controller.reset()
    assert (controller.parameters[:, problem.model.parameters.index("wind_direction")] == 1.5).all()
    controller.parameters = {"wind_direction": calm.parameters[0, problem.model.parameters.index("wind_direction")]}
    np.testing.assert_array_equal(controller.parameters, calm.parameters)
    np.testing.assert_allclose(controller.step(x, window).u.values, still.u.values, rtol=1e-9, atol=1e-9)
