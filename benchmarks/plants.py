"""What a sample of a plant takes in the core and in SUNDIALS, and how far off they are.

    python benchmarks/plants.py

Every model of the registry, some of them in many parts, and the paper's car on its drive: samples with inputs that
jump, as those of controllers do, at a tolerance of 1e-9 for both. Errors are the largest of a state after a sample,
over 1 plus its size, against SUNDIALS at 1e-12 (1e-11 with algebraic variables) from the same state.
"""

import time
from collections.abc import Callable

import numpy as np

from rumo.model import Model
from rumo.registry import MODELS
from rumo.simulation import Plant
from rumo.studies import PaperStudy
from rumo.textbook import gas_pipeline, heat_rod, mass_chain, tubular_reactor

TOLERANCE, SAMPLES, REPEATS = 1e-9, 60, 5
BEGINS = {
    "v_x": 8.0, "w_": 24.0, "t_": 72.0, "c_a": 2.14, "c_b": 1.09, "c_": 4000.0, "temperature": 114.2, "jacket": 112.9,
    "position": 1.5, "angle": 0.3, "a": 0.8, "b": 2e-5, "c": 0.2,
}  # fmt: skip
"""Where states begin whose names begin so; 0.02 where none does."""
STEPS = {"gas_pipeline": 30.0, "robertson_reactor": 2.0, "robertson_dae": 2.0}
LEVELS = {"gas_pipeline": 60.0}
PUSHES = {"gas_pipeline": 5.0, "robertson_reactor": 0.01, "robertson_dae": 0.01}


def cases() -> dict[str, Callable[[], Model]]:
    """Models by name."""
    long = {
        "heat_rod, 100 parts": lambda: heat_rod(100),
        "tubular_reactor, 50 parts": lambda: tubular_reactor(50),
        "mass_chain, 30 parts": lambda: mass_chain(30),
        "gas_pipeline, 40 parts": lambda: gas_pipeline(40),
    }
    return MODELS | long


def beginning(model: Model) -> np.ndarray:
    """A state near which the model is used."""
    if model.name == "gas_pipeline":
        return np.linspace(60.0, 52.0, len(model.states))
    return np.array([next((x for key, x in BEGINS.items() if name.startswith(key)), 0.02) for name in model.states])


Driven = tuple[tuple[Plant, ...], list[np.ndarray], np.ndarray]
"""Plants, see `plants`; inputs of the samples (nu,), and the state to begin with."""


def plants(model: Model, step: float) -> tuple[Plant, ...]:
    """Core, the same compiled, SUNDIALS, and this at a tight tolerance."""
    tight = 1e-11 if len(model.algebraic) else 1e-12
    return (
        Plant(model, step, TOLERANCE, method="radau5"),
        Plant(model, step, TOLERANCE, method="radau5", backend="tailored"),
        Plant(model, step, TOLERANCE, method="sundials"),
        Plant(model, step, tight, method="sundials"),
    )


def driven(model: Model) -> Driven:
    """A model with inputs that jump."""
    rng, push, level = np.random.default_rng(0), PUSHES.get(model.name, 1.0), LEVELS.get(model.name, 0.0)
    inputs = [level + push * rng.uniform(-1.0, 1.0, len(model.inputs)) for _ in range(SAMPLES)]
    return plants(model, STEPS.get(model.name, 0.05)), inputs, beginning(model)


def paper() -> Driven:
    """The paper's car with the inputs of the study's drive."""
    study = PaperStudy(duration=6.0)
    log = study.scenario("rti", study.problem(), study.plant()).run()
    inputs = [np.ascontiguousarray(u) for u in log["applied"].values]
    return plants(study.plant().model, study.sampling_time), inputs, np.ascontiguousarray(log["plant"].values[0])


def measured(plant: Plant, inputs: list[np.ndarray], x: np.ndarray) -> tuple[float, list[np.ndarray]]:
    """Median time of a sample [us], and the states, that to begin with first."""
    times: list[float] = []
    states: list[np.ndarray] = []
    for _ in range(REPEATS):
        plant.reset()
        states = [x]
        for u in inputs:
            begun = time.perf_counter()
            states.append(plant.advance(states[-1], u, plant.default_parameters))
            times.append(time.perf_counter() - begun)
    return 1e6 * float(np.median(times)), states


def error(exact: Plant, inputs: list[np.ndarray], states: list[np.ndarray]) -> float:
    """Largest error of a sample; NaN if the exact solution is not to be had."""
    largest = 0.0
    for before, u, after in zip(states, inputs, states[1:], strict=False):
        try:
            end = exact.advance(before, u, exact.default_parameters)
        except RuntimeError:
            return float("nan")
        largest = max(largest, float(np.abs((after - end) / (1.0 + np.abs(end))).max()))
    return largest


def main() -> None:
    """Print the table."""
    print(f"{'model':28}{'core':>9}{'compiled':>12}{'SUNDIALS':>12}{'ratio':>7}{'errors':>18}")
    for name, make in (cases() | {"the paper's drive": None}).items():
        (core, compiled, sundials, exact), inputs, x = paper() if make is None else driven(make())
        (fast, states), (fastest, _), (slow, others) = (
            measured(plant, inputs, x) for plant in (core, compiled, sundials)
        )
        errors = error(exact, inputs, states), error(exact, inputs, others)
        times = f"{fast:6.1f} us{fastest:9.1f} us{slow:9.0f} us{slow / fast:7.1f}"
        print(f"{name:28}{times}{errors[0]:9.0e}{errors[1]:9.0e}", flush=True)


if __name__ == "__main__":
    main()
