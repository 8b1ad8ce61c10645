"""Whatever numbers a problem is changed to, it is the problem that would have been made with them."""

from dataclasses import fields

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from problems import pendulum

import rumo

N = 12
NUMBERS = st.floats(0.01, 100.0)
STAGES = NUMBERS | st.lists(NUMBERS, min_size=N, max_size=N)
PENALTIES = st.none() | st.builds(rumo.Penalty, NUMBERS, NUMBERS)


def made(weight, span, lower, upper, state, limit, penalty, gravity):
    return pendulum(
        track={"angle": rumo.Weight(weight, range=span)},
        bounds={"torque": (-np.array(lower), upper), "rate": rumo.Bounds(-50.0, state, penalty)},
        constraints={"power": rumo.Constraint(lambda x, u, p: x.rate * u.torque, penalty, limit)},
        parameters={"gravity": gravity},
    )


@settings(max_examples=50, deadline=None)
@given(first=st.tuples(STAGES, NUMBERS, STAGES, STAGES, STAGES, STAGES, PENALTIES, STAGES), data=st.data())
def test_changed_problems(first, data):
    second = data.draw(st.tuples(STAGES, NUMBERS, STAGES, STAGES, STAGES, STAGES, PENALTIES, STAGES))
    weight, span, lower, upper, state, limit, penalty, gravity = second
    problem, expected = made(*first), made(*second)
    changed = problem.changed(
        weights={"angle": weight},
        ranges={"angle": span},
        bounds={"torque": (-np.array(lower), upper), "rate": rumo.Bounds(-50.0, state, penalty)},
        limits={"power": limit},
        penalties={"power": penalty, "rate": penalty},
        parameters={"gravity": gravity},
    )
    for field in fields(expected.numbers):
        np.testing.assert_array_equal(getattr(changed.numbers, field.name), getattr(expected.numbers, field.name))
    for name in ("output_weights", "move_weights", "l1", "l2"):
        np.testing.assert_array_equal(getattr(changed.numbers, name), getattr(expected.numbers, name))
