"""Actuators as data, and when their commands act."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rumo
from rumo.actuation import acting_inputs
from rumo.signals import Signals

INPUTS = Signals({"steering": "rad", "torque": "N m"}, "inputs")
seconds = st.floats(0.0, 0.5)


@settings(max_examples=200, deadline=None)
@given(seconds, seconds, seconds, st.floats(0.01, 0.2))
def test_samples_and_shares_are_the_seconds(computation, steering, torque, dt):
    actuation = rumo.Actuation(
        {"steering": rumo.Actuator(dead_time=steering), "torque": rumo.Actuator(dead_time=torque)}, computation
    )
    acting = acting_inputs(actuation, INPUTS, dt)
    first = computation + min(steering, torque)
    assert 0.0 <= acting.share < 1.0
    assert (acting.delay + acting.share) * dt == pytest.approx(first, abs=2e-6 * dt)
    np.testing.assert_allclose(
        (acting.delay + acting.rest) * dt, computation + np.array([steering, torque]), atol=4e-6 * dt
    )


@pytest.mark.parametrize("samples", [0, 1, 3, 7])
@pytest.mark.parametrize("dt", [0.04, 0.05, 0.1, 1.0 / 3.0])
def test_whole_samples_have_no_share(samples, dt):
    acting = acting_inputs(rumo.Actuation({"steering": rumo.Actuator(dead_time=0.3 * dt)}, samples * dt), INPUTS, dt)
    assert (acting.delay, acting.share) == (samples, 0.0)
    np.testing.assert_allclose(acting.rest, [0.3, 0.0], atol=1e-6)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: rumo.Actuator(lag=-0.1), r"Actuator.lag: got -0.1, expected a number of at least 0"),
        (lambda: rumo.Actuator(lag=np.inf), r"Actuator.lag: got inf, expected a finite number of seconds"),
        (lambda: rumo.Actuator(dead_time=np.nan), r"Actuator.dead_time: got nan"),
        (lambda: rumo.Actuator(rate=0.0), r"Actuator.rate: got 0, expected a positive number"),
        (lambda: rumo.Actuation({"steering": 0.1}), r"Actuation.actuators\['steering'\]: got 0.1, .*rumo.Actuator"),
        (lambda: rumo.Actuation(rumo.Actuator()), r"Actuation.actuators: got Actuator"),
        (lambda: rumo.Actuation(computation=-1.0), r"Actuation.computation: got -1.0"),
        (
            lambda: rumo.Actuation({"steer": rumo.Actuator()}).check(INPUTS, "actuation"),
            r"actuation: got 'steer', .* Did you mean 'steering'\?",
        ),
    ],
)
def test_settings_are_checked(make, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        make()
