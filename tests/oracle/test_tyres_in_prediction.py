"""Every tyre model in the prediction: the core computes what the reference does, and the car keeps to its path."""

import numpy as np
import pytest

import rumo
from rumo.references import SinePath
from rumo.simulation import Plant, Scenario
from rumo.vehicles import (
    PASSENGER_CAR,
    Dugoff,
    LinearTyre,
    MagicFormula,
    ModifiedDugoff,
    SaturatingTyre,
    dynamic_bicycle,
    friction_circles,
)

CAR = PASSENGER_CAR
PATH = SinePath(amplitude=3.0, wavelength=60.0, speed=10.0, vehicle=CAR)
TYRES = {
    type(tyre).__name__: tyre for tyre in (LinearTyre(), SaturatingTyre(), Dugoff(), ModifiedDugoff(), MagicFormula())
}


def problem(tyre):
    return rumo.Problem(
        dynamic_bicycle(CAR, tyre),
        horizon=12,
        sampling_time=0.04,
        delay=1,
        track={
            "p_x": rumo.Weight(10.0, range=20.0),
            "p_y": rumo.Weight(10.0, range=6.0),
            "psi": rumo.Weight(1.0, range=0.6),
            "v_x": rumo.Weight(1.0, range=10.0),
        },
        moves={"torque": rumo.Weight(1.0, range=3000.0), "steering_rate": rumo.Weight(1.0, range=3.0)},
        bounds={"torque": (-1500.0, 1500.0), "steering_rate": (-1.5, 1.5), "delta": (-0.6, 0.6)},
        constraints=friction_circles(CAR),
    )


def start(model):
    first = {name: float(values[0]) for name, values in PATH(np.zeros(1)).items()}
    wheels = dict.fromkeys(("w_f", "w_r"), PATH.speed / CAR.r)
    return {name: (first | wheels).get(name, 0.0) for name in model.states} | {"p_y": first["p_y"] + 0.3}


@pytest.mark.parametrize("tyre", TYRES.values(), ids=TYRES.keys())
def test_a_drive_along_the_sine_path(tyre):
    made = problem(tyre)
    plant = Plant(made.model, made.sampling_time)
    log = Scenario(made, plant, start(made.model), PATH, 3.0, backend="portable").run()
    assert set(log.status.values.tolist()) == {"OPTIMAL"}
    error = np.hypot(*(log.plant.sel(plant_state=name) - log.reference.sel(output=name) for name in ("p_x", "p_y")))
    assert error.values[0] == pytest.approx(0.3)
    assert error.values[50:].max() < 0.1


@pytest.mark.parametrize("tyre", TYRES.values(), ids=TYRES.keys())
@pytest.mark.parametrize("state", ["driving", "standing", "sliding"])
def test_the_core_computes_what_the_reference_does(tyre, state):
    made = problem(tyre)
    x = made.model.states.vector(start(made.model), "x")
    if state != "driving":
        x[3:] = 0.0 if state == "standing" else [9.0, -1.0, 0.5, 20.0, 40.0, 0.1]
    window = PATH(made.times)
    reference = {name: window[name] for name in made.outputs}
    core, ours = (
        # One iteration: several would stop where each engine finds it near enough.
        rumo.RealTimeIteration(made, backend=name, trusted_step=np.inf).step(x, reference)
        for name in ("portable", "reference")
    )
    assert core.status is ours.status
    assert np.isfinite(core.u.values).all()
    np.testing.assert_allclose((core.u.values - ours.u.values) / made.input_scales, 0.0, atol=1e-7)
