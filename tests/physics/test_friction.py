"""Friction of the road as a parameter: by time, by stage, for tyres that differ, down to none."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from model_values import derivative, jacobian

import rumo
from rumo.simulation import Constant, Scenario
from rumo.simulation.faults import Changed, Disturbed
from rumo.vehicles import (
    PASSENGER_CAR,
    Dugoff,
    ModifiedDugoff,
    SaturatingTyre,
    dynamic_bicycle,
    four_wheel,
    friction_circles,
)

SLIDING = {"v_x": 12.0, "v_y": 0.7, "omega": 0.3, "delta": 0.1}
WHEELS = dict.fromkeys(("w_f", "w_r", "w_fl", "w_fr", "w_rl", "w_rr"), 11.0 / PASSENGER_CAR.r)
SPEED = 15.0


def with_friction(car, front, rear=None):
    """The car on tyres of other friction."""
    return replace(car, front=replace(car.front, mu=front), rear=replace(car.rear, mu=front if rear is None else rear))


def at(model):
    return SLIDING | {name: speed for name, speed in WHEELS.items() if name in model.states}


@pytest.mark.parametrize("build", [dynamic_bicycle, four_wheel])
@pytest.mark.parametrize("tyre", [Dugoff(), ModifiedDugoff(), SaturatingTyre()], ids=lambda tyre: type(tyre).__name__)
def test_a_road_of_less_friction_is_a_car_on_tyres_of_less(build, tyre):
    model, slippery = build(PASSENGER_CAR, tyre), build(with_friction(PASSENGER_CAR, 0.4), tyre)
    x = at(model)
    here = derivative(model, x, p={"mu": 0.4})
    assert here == pytest.approx(derivative(slippery, x), rel=1e-12)
    assert here["v_x"] != pytest.approx(derivative(model, x)["v_x"], rel=0.1)


def test_tyres_that_differ_keep_their_ratio():
    model = four_wheel(with_friction(PASSENGER_CAR, 1.0, 0.8), Dugoff())
    assert dict(zip(model.parameters, model.default_parameters, strict=True))["mu"] == 0.8
    expected = derivative(four_wheel(with_friction(PASSENGER_CAR, 0.5, 0.4), Dugoff()), at(model))
    assert derivative(model, at(model), p={"mu": 0.4}) == pytest.approx(expected, rel=1e-12)


def test_circles_follow_the_road():
    model = dynamic_bicycle(PASSENGER_CAR)
    for constraint in friction_circles(PASSENGER_CAR).values():
        row = ca.Function("row", [model.x, model.p], [model.scalar(constraint.expression(*model.symbols), "row")])
        x = model.states.vector(at(model), "x", np.zeros(9))
        used = [float(row(x, model.parameter_vector({"mu": mu}))) + 1.0 for mu in (0.8, 0.2)]
        assert used[1] == pytest.approx(16.0 * used[0])


@pytest.mark.parametrize("build", [dynamic_bicycle, four_wheel])
@pytest.mark.parametrize("tyre", [Dugoff(), ModifiedDugoff(), SaturatingTyre()], ids=lambda tyre: type(tyre).__name__)
@pytest.mark.parametrize("mu", [0.0, -0.1, 1e-9])
def test_a_road_without_friction_has_finite_forces_and_slopes(build, tyre, mu):
    model = build(PASSENGER_CAR, tyre)
    for x in ({}, at(model)):
        slides = derivative(model, x, p={"mu": mu})
        assert np.isfinite(list(slides.values())).all()
        assert abs(slides["v_x"] - x.get("omega", 0.0) * x.get("v_y", 0.0)) < 0.1
        assert np.isfinite(jacobian(model, x, p={"mu": mu})).all()


def test_friction_may_differ_from_left_to_right():
    model, split = four_wheel(PASSENGER_CAR, Dugoff()), four_wheel(PASSENGER_CAR, Dugoff(), split_friction=True)
    assert list(split.parameters) == ["wind_speed", "wind_direction", "mu_left", "mu_right"]
    both = derivative(split, at(split), p={"mu_left": 0.5, "mu_right": 0.5})
    assert both == pytest.approx(derivative(model, at(model), p={"mu": 0.5}), rel=1e-12)
    # Locked wheels on ice to the right: the car brakes by half of both, and is turned to the left.
    x = {"v_x": 20.0}
    dry, ice = 0.8 * 9.81, 0.2 * 9.81
    slides = derivative(split, x, p={"mu_left": 0.8, "mu_right": 0.2})
    drag = PASSENGER_CAR.b_lon * 400.0 / PASSENGER_CAR.m
    assert slides["v_x"] == pytest.approx(-0.5 * (dry + ice) - drag, rel=1e-4)
    moment = 0.5 * PASSENGER_CAR.m * PASSENGER_CAR.t_w * (dry - ice)
    assert slides["omega"] == pytest.approx(moment / PASSENGER_CAR.I, rel=1e-4)


COASTING = replace(PASSENGER_CAR, brake_front=None)
"""Its front wheels roll, whatever the torque."""


def braking():
    """A car that shall stop, and may lock no wheel."""
    problem = rumo.Problem(
        dynamic_bicycle(COASTING),
        horizon=12,
        sampling_time=0.04,
        track={"v_x": rumo.Weight(1.0, range=10.0)},
        moves={"torque": rumo.Weight(1e-3, range=3000.0), "steering_rate": rumo.Weight(1.0, range=3.0)},
        bounds={"torque": (-3000.0, 3000.0)},
        constraints=friction_circles(COASTING, rumo.Penalty(10.0)),
    )
    wheels = SPEED / COASTING.r
    state = {"v_x": SPEED, "w_f": wheels, "w_r": wheels}
    return problem, problem.model.states.vector(state, "x", np.zeros(9))


def test_friction_by_stage_limits_what_is_planned_there():
    """Braking with all friction of a rear tyre, less from the middle of the horizon on; IPOPT plans the same."""
    problem, x = braking()
    mu = np.where(np.arange(12) < 6, 0.8, 0.3)
    problem = problem.changed(parameters={"mu": mu})
    plan = rumo.RealTimeIteration(problem, backend="portable").step(x, {"v_x": 0.0})
    best = rumo.DirectNlp(problem).step(x, {"v_x": 0.0})
    braked = np.diff(plan.x["v_x"]) / 0.04
    np.testing.assert_allclose(braked, np.diff(best.x["v_x"]) / 0.04, atol=0.02)
    limit = 2.0 * mu * COASTING.rear_load / COASTING.m
    drag = COASTING.b_lon * SPEED**2 / COASTING.m
    # The front wheels roll along and slow the car by their inertia alone.
    np.testing.assert_allclose(-braked[2:6], limit[2:6] + drag, rtol=0.03)
    np.testing.assert_allclose(-braked[7:], limit[7:] + drag, rtol=0.05)


def drive(**changes):
    """The four-wheel car, coasting through a bend that is tight enough to slide in."""
    problem, _ = braking()
    plant = four_wheel(PASSENGER_CAR, Dugoff())
    wheels = {f"w_{name}": SPEED / PASSENGER_CAR.r for name in ("fl", "fr", "rl", "rr")}
    state = dict.fromkeys(plant.states, 0.0) | {"v_x": SPEED, "delta": 0.12} | wheels
    scenario = Scenario(problem, plant, state, {"v_x": SPEED}, 0.6, backend="portable", **changes)
    return scenario.run()


def test_friction_varies_with_time_and_the_other_car_has_its_own():
    slippery = four_wheel(with_friction(PASSENGER_CAR, 0.3), Dugoff())
    log = drive(disturbances={"mu": Constant(0.3)})
    assert log.disturbance.sel(parameter="mu").values.tolist() == [0.3] * 15
    disturbed = drive(faults=(Disturbed(range(15), "mu", 0.3),))
    np.testing.assert_array_equal(disturbed.plant, log.plant)
    # A substitute brings its own friction, unless the run says what the friction is.
    np.testing.assert_allclose(drive(faults=(Changed(range(15), slippery),)).plant, log.plant, atol=1e-6)
    told = drive(disturbances={"mu": Constant(1.0489)}, faults=(Changed(range(15), slippery),))
    dry = drive()
    assert np.abs(dry.plant.sel(plant_state="omega") - log.plant.sel(plant_state="omega")).max() > 0.05
    assert np.abs(told.plant - log.plant).max() > 0.05
