"""Which drives pass."""

import numpy as np
import pytest
from campaign_rows import CLOSE, made_up

import rumo
from rumo.campaigns.judging.criteria import Criterion

CRITERION = Criterion("close", "tracking_error_max_after_2s_m", at_most=0.3)


def test_rows_and_tables_of_rows_are_judged_alike():
    rows = made_up(300)
    passed = CRITERION.passed(rows)
    assert passed.tolist() == [not CRITERION.why(row) for row in rows.to_dict("records")]
    assert 0 < passed.sum() < len(rows)
    known = rows[CLOSE].notna() & (rows["outcome"] == "done")
    np.testing.assert_array_equal(passed, known & (rows[CLOSE] <= 0.3))


@pytest.mark.parametrize(
    ("row", "why"),
    [
        ({"outcome": "done", CLOSE: 0.3}, ""),
        ({"outcome": "done", CLOSE: 0.31}, "0.31, more than 0.3"),
        ({"outcome": "done", CLOSE: None}, "not known"),
        ({"outcome": "done", CLOSE: float("nan")}, "not known"),
        ({"outcome": "done"}, "not known"),
        ({"outcome": "timeout", CLOSE: 0.1}, "timeout"),
    ],
)
def test_a_run_that_fails_says_why(row, why):
    assert CRITERION.why(row) == why


def test_limits_on_both_sides_and_times_of_steps():
    rows = made_up(20, failures=False)
    slow = Criterion("quick", "step_time_p99_us", at_least=1.0, at_most=100.0)
    times = rows["run.step_time_p99_us"]
    assert slow.passed(rows).tolist() == [name == "rti" for name in rows["controller"]]
    np.testing.assert_allclose(slow.excess(rows), np.fmax(1.0 - times, times - 100.0))
    assert not Criterion("none", "no_such", at_most=1.0).passed(rows).any()


def test_words_and_plain_data():
    assert CRITERION.words == "largest error after 2 s at most 0.3 m"
    assert Criterion("x", "tracking_error_rms_m", 1.0, 0.5).words == "RMS error at least 0.5 and at most 1 m"
    assert Criterion.of("close", CRITERION.plain) == CRITERION


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"kpi": "fallbacks"}, "criteria.a: got no limit, expected at_most, at_least, or both"),
        ({"kpi": "fallbacks", "at_most": float("nan")}, "criteria.a.at_most: got nan, expected a finite number"),
        ({"kpi": "fallbacks", "at_most": "0"}, "criteria.a.at_most: got '0', expected a finite number"),
        ({"kpi": "fallbacks", "at_most": True}, "criteria.a.at_most: got True"),
        ({"kpi": "fallbacks", "at_most": 1, "at_least": 2}, "limits with something between them"),
        ({"kpi": 3, "at_most": 1}, "criteria.a.kpi: got 3, expected the key of a figure of merit"),
        ({"kpi": "fallbacks", "atmost": 1}, "Did you mean 'at_most'?"),
        ({"at_most": 1}, "criteria.a: got no kpi"),
        (0.3, "criteria.a: got 0.3, expected a table such as"),
    ],
)
def test_what_is_no_criterion_says_so(table, message):
    with pytest.raises(rumo.ArgumentError) as error:
        Criterion.of("a", table)
    assert message in str(error.value)
