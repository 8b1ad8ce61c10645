"""Tyres whose forces fall beyond their peak, without friction circles: the iteration holds what the NLP holds.

There a linearisation promises what no step in its direction keeps, however short, and steps have to be damped.
"""

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
import pytest

import rumo
from rumo.simulation import Plant
from rumo.vehicles import PASSENGER_CAR, ModifiedDugoff, dynamic_bicycle

STEPS = 80
INPUTS = {"torque": 750.0, "steering_rate": 1.5}
WEIGHTS = {"p_y": (1.0, 1.0), "psi": (0.5, 0.5), "v_x": (0.5, 2.0)}
MOVES = 0.1


@dataclass(frozen=True)
class MagicFormula:
    """mu F_z sin(C atan(n / C)) along the slip, n being the linear force over mu F_z; Pacejka (2012), chapter 4."""

    C: float = 1.5

    def force(self, tyre, sigma, tan_alpha, F_z, mu, direction=1.0):
        along, across, limit = tyre.C_s * sigma, tyre.C_a * tan_alpha, mu * F_z
        n = ca.sqrt(along**2 + across**2 + 1e-10) / limit
        share = ca.sin(self.C * ca.atan(n / self.C)) / n
        return share * along, share * across


def beside_a_straight_road(tyre, mu, speed, error, **changes):
    """A passenger car on slippery ground, some metres beside its road: problem, state, reference."""
    car = replace(PASSENGER_CAR, front=replace(PASSENGER_CAR.front, mu=mu), rear=replace(PASSENGER_CAR.rear, mu=mu))
    problem = rumo.Problem(
        dynamic_bicycle(car, tyre),
        horizon=20,
        sampling_time=0.04,
        **({"delay": 1} | changes),
        track={name: rumo.Weight(weight, range=size) for name, (weight, size) in WEIGHTS.items()},
        moves={name: rumo.Weight(MOVES, range=2.0 * most) for name, most in INPUTS.items()},
        bounds={name: (-most, most) for name, most in INPUTS.items()} | {"delta": (-0.6, 0.6)},
    )
    wheels = speed / car.r
    state = {"v_x": speed, "p_y": error, "w_f": wheels, "w_r": wheels}
    x = [state.get(name, 0.0) for name in problem.model.states]
    return problem, np.array(x), {"p_y": 0.0, "psi": 0.0, "v_x": speed}


def cost_of_drive(controller, x, reference):
    """What a drive of the model itself costs by the problem's weights; and its largest heading."""
    problem, names = controller.problem, list(controller.problem.model.states)
    plant, decided, cost, heading = Plant(problem.model, problem.sampling_time), np.zeros(2), 0.0, 0.0
    ranges = np.array([2.0 * most for most in INPUTS.values()])
    for _ in range(STEPS):
        command = np.array(controller.step(x, reference).command.values)
        x = plant.advance(x, decided, problem.parameters[0])
        errors = {name: (x[names.index(name)] - reference[name]) / size for name, (_, size) in WEIGHTS.items()}
        cost += sum(weight * errors[name] ** 2 for name, (weight, _) in WEIGHTS.items())
        cost += MOVES * (((command - decided) / ranges) ** 2).sum()
        heading, decided = max(heading, abs(x[names.index("psi")])), command
    return cost, heading


@pytest.mark.parametrize(
    ("tyre", "mu", "speed", "error"),
    [
        pytest.param(MagicFormula(), 0.4, 25.0, 3.0, id="fast", marks=pytest.mark.slow),
        pytest.param(MagicFormula(), 0.3, 8.0, -6.0, id="far", marks=pytest.mark.slow),
        pytest.param(MagicFormula(), 0.9, 12.0, 4.0, id="dry", marks=pytest.mark.slow),
        pytest.param(ModifiedDugoff(), 0.4, 25.0, 3.0, id="modified Dugoff", marks=pytest.mark.slow),
        pytest.param(ModifiedDugoff(), 0.6, 15.0, -5.0, id="modified Dugoff, far", marks=pytest.mark.slow),
    ],
)
def test_the_car_is_held_as_by_the_nlp(tyre, mu, speed, error):
    problem, x, reference = beside_a_straight_road(tyre, mu, speed, error)
    cost, heading = cost_of_drive(rumo.RealTimeIteration(problem, gate=None), x, reference)
    best, best_heading = cost_of_drive(rumo.DirectNlp(problem, gate=None, max_iterations=1000), x, reference)
    assert cost < 1.05 * best
    assert heading < best_heading + 0.1


@pytest.mark.parametrize(
    "changes",
    [
        pytest.param({}, id="as it is"),
        pytest.param({"blocks": rumo.IncrementBlocks([2, 3, 5, 9])}, id="blocks", marks=pytest.mark.slow),
        pytest.param({"move_bounds": {"steering_rate": (-0.3, 0.3)}}, id="move bounds", marks=pytest.mark.slow),
        pytest.param({"delay": 3}, id="delay", marks=pytest.mark.slow),
    ],
)
@pytest.mark.parametrize(
    "iterations",
    [
        pytest.param(4, id="cut steps only"),
        pytest.param(6, id="no time to damp", marks=pytest.mark.slow),
        pytest.param(50, id="damped"),
    ],
)
def test_solvers_damp_alike(changes, iterations):
    problem, x, reference = beside_a_straight_road(MagicFormula(), 0.4, 25.0, 3.0, **changes)
    ways = [{"qp": rumo.QpOptions(solver="condensing")}, {"qp": rumo.QpOptions(solver="riccati")}]
    ways = [{"backend": "reference"}, *(way | {"backend": "portable"} for way in ways)]
    options = {"gate": None, "settling_iterations": iterations}
    plans = [rumo.RealTimeIteration(problem, **options, **way).step(x, reference) for way in ways]
    assert [plan.status for plan in plans] == 3 * [rumo.Status.UNTRUSTED]
    for plan in plans[1:]:
        assert np.abs((plan.u.values - plans[0].u.values) / problem.input_scales).max() < 1e-6
