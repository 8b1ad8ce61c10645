"""The failure policy by itself: what is admitted, what is followed, what is applied."""

from dataclasses import replace

import numpy as np
import pytest

from rumo.kernel import Guard, Settings, Trajectory
from rumo.status import Status

N, NX, NU, DELAY = 4, 2, 1, 1
SIZES = {"horizon": N, "states": NX, "algebraic": 0, "inputs": NU, "delay": DELAY}
VALUES = {
    "shift_stages": np.array([1, 2, 3, 3, 3]),
    "shift_shares": np.array([0.0, 0.0, 0.0, 1.0, 2.0]),
    "shift_intervals": np.array([1, 2, 3, 3]),
    "inner_signals": np.zeros(0),
    "inner_nodes": np.zeros(0),
    "input_lower": np.array([-1.0]),
    "input_upper": np.array([1.0]),
    "move_lower": np.array([-0.5]),
    "move_upper": np.array([0.4]),
    "safe_input": np.array([0.2]),
}
GATE = Settings(gate_width=3.0, gate_patience=2)
REACH = np.array([1.0, 2.0])
NOTHING = np.zeros(0)


def guard(settings=GATE, **changes):
    return Guard(SIZES, VALUES | changes, settings)


def candidate(u, slope=0.0):
    """Inputs as given, states on a straight line from 0."""
    x = slope * np.arange(N + 1)[:, None] * [1.0, 0.0]
    return Trajectory(np.reshape(u, (N, NU)).astype(float), x, np.zeros((N, 0)))


def with_plan(settings=GATE, **changes):
    made = guard(settings, **changes)
    made.follow(candidate([0.2, 0.2, 0.2, 0.2]), Status.OPTIMAL)
    return made


def verdicts(keeper, samples, reach=REACH):
    found = []
    for x in samples:
        status = keeper.admit(np.array(x, dtype=float), NOTHING, reach)
        found.append(status is Status.OPTIMAL)
    return found


def test_the_width_is_in_units_of_reach_and_plan():
    for x, plausible in [([3.0, 0.0], True), ([3.001, 0.0], False), ([0.0, -6.0], True), ([0.0, -6.001], False)]:
        assert verdicts(with_plan(), [x]) == [plausible]
    for units, plausible in [(41.0, True), (41.001, False)]:
        moving = guard()
        moving.follow(candidate([0.2] * N, slope=-10.0), Status.OPTIMAL)  # from -10 to -50 one sample later
        assert verdicts(moving, [[-10.0 + 3.0 * units, 0.0]]) == [plausible]


def test_it_narrows_from_the_first_sample_on():
    """To a hundredth within 20 samples, though never below what has been believed."""
    for samples, widest in [(0, 3.0), (10, 0.3), (14, 3.0 * 0.01**0.7)]:
        for x, plausible in [(0.99 * widest, True), (1.01 * widest, False)]:
            keeper = with_plan()
            assert all(verdicts(keeper, [[0.01 * (-1) ** i, 0.01] for i in range(samples)]))
            assert verdicts(keeper, [[x, 0.0]]) == [plausible]
    keeper = with_plan()
    assert verdicts(keeper, [[2.9, 0.0], *([[0.0, 0.01 * i] for i in range(20)]), [2.9, 0.0]]) == [True] * 22


def test_a_plan_that_is_not_trusted_counts_no_turns():
    turn = 2.0 * np.pi
    for status, taken in [(Status.OPTIMAL, 0.2 - turn), (Status.UNTRUSTED, 0.2)]:
        keeper = guard(replace(GATE, gate_width=np.inf), sensors_turn=np.array([turn, 0.0]))
        keeper.follow(candidate([0.2] * N, slope=-6.0), status)  # from 0 to -6 rad one sample later
        assert keeper.admit(np.array([0.2, 0.0]), NOTHING, None) is Status.OPTIMAL
        np.testing.assert_allclose(keeper.taken, [taken, 0.0])
        keeper.follow(candidate([0.2] * N, slope=-6.0), status)
        assert keeper.admit(np.array([-5.9, 0.0]), NOTHING, None) is Status.OPTIMAL
        np.testing.assert_allclose(keeper.taken, [-5.9, 0.0])  # as predicted, whatever that is worth


def test_nor_does_what_is_left_of_it():
    """Neither after a bad sample, nor beside sensors whose readings are old."""
    turn = {"sensors_turn": np.array([2.0 * np.pi, 0.0])}
    wide, astray = replace(GATE, gate_width=np.inf), candidate([0.2] * N, slope=-6.0)  # -6 rad with each sample
    keeper = guard(wide, **turn)
    assert keeper.admit(np.array([0.2, 0.0]), NOTHING, None) is Status.OPTIMAL
    keeper.follow(astray, Status.UNTRUSTED)
    assert keeper.admit(np.array([np.nan, 0.0]), NOTHING, None) is Status.BAD_MEASUREMENT
    keeper.follow(None, Status.BAD_MEASUREMENT)
    assert keeper.admit(np.array([0.3, 0.0]), NOTHING, None) is Status.OPTIMAL
    np.testing.assert_allclose(keeper.taken, [0.3, 0.0])

    keeper = guard(wide, **turn, sensors_age=np.array([0, 1]))
    assert keeper.admit(np.array([0.2, 0.0]), NOTHING, None) is Status.OPTIMAL
    keeper.follow(astray, Status.UNTRUSTED)
    assert keeper.admit(np.array([0.3, 0.0]), NOTHING, None) is Status.OPTIMAL
    np.testing.assert_allclose(keeper.taken, [0.3, 0.0])


def test_a_state_that_inputs_do_not_reach_is_not_judged():
    assert verdicts(with_plan(), [[0.0, 1e9], [3.001, 1e9]], np.array([1.0, 0.0])) == [True, False]


def test_no_gate_where_reach_is_not_known_or_there_is_no_plan():
    assert verdicts(with_plan(), [[1e9, 0.0]], None) == [True]
    assert verdicts(guard(), [[1e9, 0.0]]) == [True]
    assert verdicts(with_plan(replace(GATE, gate_width=np.inf)), [[1e9, 0.0]]) == [True]


@pytest.mark.parametrize("patience", [0, 1, 4])
def test_samples_that_agree_are_believed_after_patience(patience):
    keeper = with_plan(Settings(gate_width=3.0, gate_patience=patience))
    assert keeper.has_guess
    assert verdicts(keeper, [[50.0, 0.0]] * (patience + 1)) == [False] * patience + [True]
    assert not keeper.has_guess, "what was predicted is wrong"
    assert verdicts(keeper, [[0.0, 0.0]]) == [True]


def test_samples_that_disagree_start_anew_and_a_good_one_ends_the_count():
    samples = [[50.0, 0.0], [50.0, 0.0], [-50.0, 0.0], [-50.0, 0.0], [-50.0, 0.0]]
    assert verdicts(with_plan(), samples) == [False, False, False, False, True]
    samples = [[50.0, 0.0], [50.0, 0.0], [0.0, 0.0], [50.0, 0.0], [50.0, 0.0], [50.0, 0.0]]
    assert verdicts(with_plan(), samples) == [False, False, True, False, False, True]


def test_a_frozen_sample_is_held_back_once_the_prediction_has_moved():
    keeper = with_plan()
    changing = [[0.01 * k, 0.0] for k in range(1, 6)]
    assert verdicts(keeper, changing + [[0.05, 0.0]] * 4) == [True] * 5 + [False, False, True, True]
    assert verdicts(with_plan(), [[0.05, 0.0]] * 10) == [True] * 10, "some callers always pass the same"


def test_what_is_not_finite():
    keeper = with_plan()
    assert keeper.admit(np.array([np.nan, 0.0]), NOTHING, REACH) is Status.BAD_MEASUREMENT
    assert keeper.admit(np.zeros(2), np.array([1.0, np.inf]), REACH) is Status.BAD_REFERENCE
    assert keeper.admit(np.array([np.inf, 0.0]), np.array([np.nan]), REACH) is Status.BAD_MEASUREMENT


def test_a_solution_is_applied_within_bounds_and_move_bounds():
    keeper = guard()
    keeper.applied = np.array([[0.5]])
    assert keeper.follow(candidate([9.0, 0.8, 1.5, -1.0]), Status.SOFT_VIOLATED) == (Status.SOFT_VIOLATED,) * 2
    np.testing.assert_allclose(keeper.plan.u.ravel(), [0.5, 0.8, 1.0, 0.5])
    np.testing.assert_allclose(keeper.applied, [[0.8]])
    assert keeper.counts == {Status.SOFT_VIOLATED: 1}
    np.testing.assert_allclose(keeper.next.u.ravel(), [0.8, 1.0, 0.5, 0.5])
    assert keeper.has_guess


def test_without_a_solution_the_plan_is_followed_to_its_end_then_the_safe_input():
    keeper = guard()
    assert keeper.next is None
    keeper.follow(candidate([0.2, 0.3, 0.4, 0.5], slope=1.0), Status.OPTIMAL)
    for later in (1, 2):
        assert keeper.follow(None, Status.BAD_MEASUREMENT) == (Status.BAD_MEASUREMENT,) * 2
        np.testing.assert_allclose(keeper.applied, [[0.3 + 0.1 * later]])
        np.testing.assert_allclose(keeper.plan.x[:, 0], later + np.arange(N + 1), atol=1e-12)
        assert keeper.has_guess
    assert keeper.follow(None, Status.BAD_REFERENCE) == (Status.PLAN_EXHAUSTED, Status.BAD_REFERENCE)
    assert keeper.next is None
    assert not keeper.has_guess
    assert np.isnan(keeper.plan.x).all()
    np.testing.assert_allclose(keeper.plan.u.ravel(), [0.5, 0.2, 0.2, 0.2])
    keeper.reset()
    assert not keeper.counts
    np.testing.assert_array_equal(keeper.applied, [[0.2]])


@pytest.mark.parametrize("cause", [Status.SOLVER_FAILED, Status.ILL_CONDITIONED])
def test_a_guess_that_led_nowhere_is_dropped_unless_one_at_rest_fails_too(cause):
    keeper = with_plan()
    keeper.follow(None, cause)
    assert not keeper.has_guess
    np.testing.assert_array_equal(keeper.rest(), np.full((N, NU), 0.2))
    assert keeper.has_guess
    keeper.follow(None, cause)
    assert keeper.has_guess, "the shifted plan was not to blame"
    keeper.drop()
    assert not keeper.has_guess


def test_a_guess_that_had_no_time_is_kept():
    keeper = with_plan()
    keeper.follow(None, Status.BUDGET_EXCEEDED)
    assert keeper.has_guess
    keeper.follow(None, Status.SOLVER_FAILED)
    assert not keeper.has_guess


def test_a_guess_that_strays_is_dropped_if_those_before_it_did_not():
    keeper = with_plan()

    def kept(straying):
        found = keeper.keep(straying)
        assert keeper.has_guess is found
        keeper.follow(candidate([0.2] * N), Status.OPTIMAL)
        return found

    assert [kept(straying) for straying in (0.1, 0.02, 0.02, 0.04)] == [True, True, True, False]
    keeper.rest()
    assert kept(np.inf), "one at rest has nothing to satisfy"
    assert [kept(straying) for straying in (5.0, 0.5, 0.02, np.nan)] == [True, True, True, False]
    keeper.reset()
    assert keeper.keep(0.1)


def test_a_sample_prepared_again_is_judged_as_if_for_the_first_time():
    keeper = with_plan()
    assert [keeper.keep(straying) for straying in (0.02, 0.1, 0.02)] == [True] * 3
    keeper.follow(candidate([0.2] * N), Status.OPTIMAL)
    assert not keeper.keep(0.1)


@pytest.mark.parametrize("part", range(2))
@pytest.mark.parametrize(
    ("status", "cause"),
    [
        (Status.OPTIMAL, Status.SOLVER_FAILED),
        (Status.SOFT_VIOLATED, Status.SOLVER_FAILED),
        (Status.BUDGET_EXCEEDED, Status.BUDGET_EXCEEDED),
    ],
)
def test_a_solution_that_is_not_finite_is_none(part, status, cause):
    keeper = with_plan()
    proposed = candidate([0.1] * N)
    proposed[part][-1, -1] = np.nan
    assert keeper.follow(proposed, status) == (cause, cause)
    np.testing.assert_array_equal(keeper.plan.u.ravel(), [0.2] * N)


def test_bounds_of_each_interval():
    keeper = guard(input_upper=np.array([[1.0], [0.5], [0.3], [1.0]]), move_upper=np.array([np.inf]))
    keeper.follow(candidate([0.0, 0.9, 0.9, 0.9]), Status.OPTIMAL)
    np.testing.assert_allclose(keeper.plan.u.ravel(), [0.2, 0.5, 0.3, 0.9])
    keeper.applied = np.array([[0.9]])
    np.testing.assert_allclose(keeper.rest().ravel(), [0.9, 0.5, 0.3, 0.9])


def test_other_bounds_between_two_samples():
    keeper = with_plan()
    keeper.update({"input_upper": np.array([0.1]), "safe_input": np.array([0.0])})
    keeper.follow(None, Status.SOLVER_FAILED)
    np.testing.assert_allclose(keeper.applied, [[0.1]])
    with pytest.raises(ValueError, match=r"input_lower\[0\] is above the upper limit"):
        keeper.update({"input_upper": np.array([-2.0])})
    keeper.follow(candidate([0.0, 1.0, 1.0, 1.0]), Status.OPTIMAL)
    np.testing.assert_allclose(keeper.applied, [[0.1]], err_msg="nothing has changed")


def test_another_gate_between_two_samples():
    keeper = with_plan()
    assert verdicts(keeper, [[3.9, 0.0]]) == [False]
    keeper.configure(replace(GATE, gate_width=5.0))
    assert verdicts(keeper, [[3.9, 0.0]]) == [True]


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("shift_stages", np.array([1, 2, 3, 4, 3]), r"shift_stages\[3\] is out of range"),
        ("shift_shares", np.array([0.0, np.nan, 0.0, 1.0, 2.0]), r"shift_shares\[1\] is not a finite number"),
        ("move_lower", np.array([0.1]), r"move_lower\[0\] does not allow to stay"),
        ("safe_input", np.array([0.1, 0.2]), r"safe_input: expected 1 doubles \(1, 1\)"),
    ],
)
def test_what_cannot_be_raises(name, value, message):
    with pytest.raises(ValueError, match=message):
        guard(**{name: value})


def test_old_readings_are_brought_to_now_by_the_plans_followed():
    keeper = guard(sensors_age=np.array([2, 0]))
    for slope, first in ((1.0, 0.0), (3.0, 1.0), (5.0, 4.0)):
        x = first + slope * np.arange(N + 1)[:, None] * [1.0, 0.0]
        keeper.follow(candidate([0.2] * N)._replace(x=x), Status.OPTIMAL)
    # From 0 to 1, 4 and 9: two samples ago it was believed to be at 1.
    assert keeper.unwound(np.array([1.5, 7.0])).tolist() == [9.5, 7.0]
    assert keeper.unwound(np.array([1.5, 7.0])).tolist() == [9.5, 7.0], "asking changes nothing"
    keeper.reset()
    assert keeper.unwound(np.array([1.5, 7.0])).tolist() == [1.5, 7.0]


def test_a_share_of_an_old_innovation_is_left_and_the_past_is_corrected_once():
    def followed(times):
        keeper = guard(sensors_age=np.array([2, 0]))
        for _ in range(2):
            keeper.follow(candidate([0.2] * N), Status.OPTIMAL)
            keeper.expect(np.diag([0.5, 1.0]))
        assert keeper.admit(np.array([0.4, 0.0]), NOTHING, REACH) is Status.OPTIMAL
        assert keeper.taken.tolist() == [0.1, 0.0]
        keeper.follow(candidate([0.2] * N)._replace(x=np.full((N + 1, NX), [0.1, 0.0])), Status.OPTIMAL)
        for _ in range(times - 1):
            keeper.take_back()
            keeper.follow(candidate([0.2] * N)._replace(x=np.full((N + 1, NX), [0.1, 0.0])), Status.OPTIMAL)
        # Believed now to have been at 0.4, 0.2 and 0.1, and to stay there: the next reading says nothing new.
        return keeper.unwound(np.array([0.2, 0.0])).tolist()

    assert followed(1) == followed(2) == pytest.approx([0.1, 0.0])


@pytest.mark.parametrize("failures", [0, 1, N - DELAY])
def test_the_past_is_as_it_was_once_a_failure_is_taken_back(failures):
    """Even where the plan was exhausted, and nothing was known of the next sample."""
    keeper = guard(sensors_age=np.array([3, 0]))

    def moving(first):
        return candidate([0.2] * N)._replace(x=first + np.arange(N + 1)[:, None] * [1.0, 0.0])

    for first in range(4):
        keeper.follow(moving(float(first)), Status.OPTIMAL)
    for k in range(failures):
        status, _ = keeper.follow(None, Status.SOLVER_FAILED)
        assert (status is Status.PLAN_EXHAUSTED) == (k >= N - DELAY - 1)
    if failures:
        keeper.take_back()
    keeper.follow(moving(100.0), Status.OPTIMAL)
    assert keeper.next is not None
    assert keeper.unwound(np.array([50.0, 0.0]))[0] == pytest.approx(53.0)


def test_ages_are_within_the_horizon():
    for age in (-1, N + 1):
        with pytest.raises(ValueError, match=r"sensors_age\[0\] is out of range"):
            guard(sensors_age=np.array([age, 0]))
