"""Different ways to the same plan."""

import numpy as np
import pytest
from problems import PROBLEMS, pendulum

import rumo
from rumo.registry import CONTROLLERS


@pytest.mark.parametrize("name", PROBLEMS)
def test_step_is_prepare_and_feedback(name):
    problem, x, reference = PROBLEMS[name]()
    together, apart = rumo.RealTimeIteration(problem), rumo.RealTimeIteration(problem)
    apart.reset(x)
    for _ in range(3):
        apart.prepare()
        plan = apart.feedback(x, reference)
        np.testing.assert_array_equal(together.step(x, reference).u.values, plan.u.values)


@pytest.mark.parametrize("make", CONTROLLERS.values())
def test_reset_forgets_everything(make):
    problem = pendulum()
    used, fresh = make(problem), make(problem)
    for angle in (0.5, np.nan, -0.2):
        used.step([angle, 0.0], {"angle": 1.0, "rate": 0.0})
    used.reset()
    x, reference = [0.1, -0.1], {"angle": 0.3, "rate": 0.0}
    np.testing.assert_allclose(used.step(x, reference).u.values, fresh.step(x, reference).u.values, atol=1e-12)
    assert sum(used.status_counts.values()) == 1


def test_all_controllers_agree_on_a_linear_model():
    reference = {"angle": 0.4, "rate": 0.0}
    plans = [make(pendulum()).step([0.3, -0.2], reference).u.values for make in CONTROLLERS.values()]
    np.testing.assert_allclose(plans[1], plans[0], atol=1e-6)  # IPOPT's default tolerance is 1e-8
    np.testing.assert_allclose(plans[2], plans[0], atol=1e-8)


def test_measurement_and_reference_in_any_form():
    problem = pendulum()
    plans = [
        rumo.RealTimeIteration(problem).step(x, reference).u.values
        for x, reference in (
            ([0.3, -0.2], {"angle": 0.4}),
            ({"rate": -0.2, "angle": 0.3}, {"angle": np.full(13, 0.4)}),
            (np.array([0.3, -0.2]), np.full((13, 1), 0.4)),
        )
    ]
    np.testing.assert_array_equal(plans[1], plans[0])
    np.testing.assert_array_equal(plans[2], plans[0])


def test_units_do_not_matter():
    # The same pendulum in degrees and millinewton metres.
    turn = 180.0 / np.pi
    model = rumo.Model(
        states={"angle": "deg", "rate": "deg/s"},
        inputs={"torque": "mN m"},
        dynamics=lambda x, u, p: {"angle": x.rate, "rate": 1e-3 * u.torque * turn - 9.81 * x.angle},
    )
    degrees = rumo.Problem(
        model,
        horizon=12,
        sampling_time=0.05,
        delay=1,
        track={"angle": rumo.Weight(1.0, range=1.0 * turn)},
        moves={"torque": rumo.Weight(0.1, range=4000.0)},
        bounds={"torque": (-2000.0, 2000.0)},
    )
    radians = rumo.RealTimeIteration(pendulum()).step([0.3, -0.2], {"angle": 0.4})
    plan = rumo.RealTimeIteration(degrees).step([0.3 * turn, -0.2 * turn], {"angle": 0.4 * turn})
    np.testing.assert_allclose(1e-3 * plan.u.values, radians.u.values, atol=1e-8)


def test_stage_weights_equal_constant_ones_and_can_differ():
    def command(weight):
        return rumo.RealTimeIteration(pendulum(track={"angle": weight})).step([0.3, 0.0], {"angle": 0.0}).u.values

    np.testing.assert_array_equal(command(rumo.Weight(2.0, 0.5)), command(rumo.Weight([2.0] * 12, 0.5)))
    assert np.abs(command(rumo.Weight([0.0] * 11 + [24.0])) - command(rumo.Weight(2.0))).max() > 1e-3


def test_an_output_may_be_any_expression():
    def track(model_outputs, name):
        model = rumo.Model(
            states={"a": "m", "b": "m"},
            inputs={"push": "m/s"},
            dynamics=lambda x, u, p: {"a": u.push, "b": x.a - x.b},
            outputs=model_outputs,
        )
        return rumo.Problem(
            model,
            horizon=8,
            sampling_time=0.1,
            track={name: rumo.Weight(1.0)},
            moves={"push": rumo.Weight(0.1)},
        )

    feedthrough = {"speed": rumo.Output("m/s", lambda x, u, p: u.push + 0.5 * x.b)}
    problem = track(feedthrough, "speed")
    rti = rumo.RealTimeIteration(problem).step([1.0, 0.5], {"speed": 0.7})
    nlp = rumo.DirectNlp(problem).step([1.0, 0.5], {"speed": 0.7})
    np.testing.assert_allclose(rti.u.values, nlp.u.values, atol=1e-6)
    itself = track({"alias": rumo.Output("m", lambda x, u, p: x.b)}, "alias")
    direct = track({}, "b")
    np.testing.assert_array_equal(
        rumo.RealTimeIteration(itself).step([1.0, 0.5], {"alias": 0.2}).u.values,
        rumo.RealTimeIteration(direct).step([1.0, 0.5], {"b": 0.2}).u.values,
    )


def test_applied_inputs_by_name_or_by_position():
    plans = []
    for applied in ({"torque": 0.4}, [0.4], [[0.4]]):
        controller = rumo.RealTimeIteration(pendulum())
        controller.reset(applied=applied)
        plans.append(controller.step([0.3, -0.2], {"angle": 0.4}).u.values)
    assert plans[0][0, 0] == 0.4
    np.testing.assert_array_equal(plans[1], plans[0])
    np.testing.assert_array_equal(plans[2], plans[0])
