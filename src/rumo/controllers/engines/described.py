"""What the C core is told about a problem, its scheme and a controller's settings."""

from __future__ import annotations

import numpy as np

from rumo.controllers.settings import ControllerSettings, LtvSettings, Settings
from rumo.discretization.stability import lead
from rumo.kernel import BOUNDS, Description, Guard, describe
from rumo.kernel import Settings as CoreSettings
from rumo.problem import Problem
from rumo.recording import stage_program
from rumo.shift import Shift
from rumo.signals import Array
from rumo.transcription import Transcription

MOST_FREE_INPUTS = 8
"""For each state of a wide model that is condensed: from there on Riccati sweeps are no slower, by times measured."""


def core_settings(settings: ControllerSettings, problem: Problem | None = None) -> CoreSettings:
    """Settings as the core has them, for a problem where it solves one; a method in Python has a gate, and time."""
    gate = settings.gate
    width, patience = (np.inf, 0) if gate is None else (gate.width, gate.patience)
    if not isinstance(settings, Settings):
        seconds = settings.qp.time_limit if isinstance(settings, LtvSettings) else np.inf
        return CoreSettings(seconds=seconds, gate_width=width, gate_patience=patience)
    return CoreSettings(
        sqp_iterations=settings.sqp_iterations,
        preparation_iterations=settings.preparation_iterations,
        sqp_tolerance=settings.tolerance,
        settling_iterations=settings.settling_iterations,
        trusted_step=settings.trusted_step,
        qp_iterations=settings.qp.iterations(0 if problem is None else _rows(problem)),
        qp_tolerance=settings.qp.tolerance,
        seconds=settings.qp.time_limit,
        gate_width=width,
        gate_patience=patience,
    )


def _rows(problem: Problem) -> int:
    """Rows of a problem's QP, with bounds of moves whether it has some or not."""
    blocks, inputs = len(problem.blocks.lengths), len(problem.model.inputs)
    return 2 * blocks * inputs + problem.horizon * len(problem.constraints)


def core_problem(transcription: Transcription, solver: str = "auto") -> Description:
    """A problem, its scheme, and how its quadratic programs are solved: see `QpOptions.solver`."""
    problem, scheme = transcription.problem, transcription.discretization
    model, blocks = problem.model, problem.blocks
    sizes = _sizes(problem) | {
        "outputs": len(problem.outputs),
        "constraints": len(problem.constraints),
        "parameters": transcription.interval.size1_in(3),
        "inner": len(scheme.inner(len(model.states), len(model.algebraic))),
        "substeps": scheme.substeps,
        "explicit_scheme": scheme.explicit,
        "blocks": len(blocks.lengths),
        "condensing": int(condenses(problem, solver)),
        "shift_same_rows": int(problem.uniform),
    }
    values = numbers_of(transcription) | _placed(transcription)
    blocking = {"block": blocks.block_of, "share": blocks.shares(), "part": blocks.parts()}
    for name, array in blocking.items():  # of all intervals; those before the first free one have none
        values[f"blocking_{name}"] = np.concatenate([np.zeros(problem.delay, array.dtype), array])
    values["output_states"] = problem.sensors.output_states
    values |= {"imposed": transcription.imposed, "algebraic_guess": model.algebraic_guess}
    return describe(stage_program(transcription), sizes, values, maps=sweeps(problem, solver))


def condenses(problem: Problem, solver: str) -> bool:
    """Whether states are condensed: unless asked for, where a horizon has no more free inputs than the model states.

    Wide models are condensed too where nothing needs maps of the stages, see `sweeps`.
    """
    return solver == "condensing" or (solver == "auto" and _free_inputs(problem) <= len(problem.model.states))


def sweeps(problem: Problem, solver: str) -> bool:
    """Whether Riccati sweeps need the stages' maps, even of models so wide that condensing goes without.

    Unless asked for, where there are `MOST_FREE_INPUTS` for each of its states.
    """
    many = _free_inputs(problem) > MOST_FREE_INPUTS * len(problem.model.states)
    return solver == "riccati" or (solver == "auto" and many)


def _free_inputs(problem: Problem) -> int:
    return len(problem.blocks.lengths) * len(problem.model.inputs)


def numbers_of(transcription: Transcription) -> dict[str, Array]:
    """All that may change between two samples."""
    problem, numbers = transcription.problem, transcription.problem.numbers
    lower, upper = problem.block_move_bounds
    return (
        limits_of(problem)
        | {
            "output_weights": numbers.output_weights,
            "move_weights": problem.block_move_weights,
            "input_scales": numbers.input_scales,
            "block_lower": lower,
            "block_upper": upper,
            "constraint_limits": numbers.limits,
            "constraint_scales": numbers.constraint_scales,
            "l1": numbers.l1,
            "l2": numbers.l2,
        }
        | parameters_of(transcription)
    )


def parameters_of(transcription: Transcription) -> dict[str, Array]:
    """Of these, what changes where a model's parameters do."""
    return {"parameter_values": transcription.given(transcription.problem.numbers.parameters)}


def limits_of(problem: Problem) -> dict[str, Array]:
    """What holds for the inputs whatever happens."""
    return {name: getattr(problem.numbers, name) for name in BOUNDS}


def guard_of(transcription: Transcription, settings: ControllerSettings, read: bool = True) -> Guard:
    """The failure policy of a problem, for a method in Python; of sensors only angles where states are not `read`."""
    values = limits_of(transcription.problem) | _placed(transcription)
    if not read:
        values = {name: v for name, v in values.items() if not name.startswith("sensors_") or name == "sensors_turn"}
    return Guard(_sizes(transcription.problem), values, core_settings(settings))


def _sizes(problem: Problem) -> dict[str, int]:
    model = problem.model
    return {
        "horizon": problem.horizon,
        "states": len(model.states),
        "algebraic": len(model.algebraic),
        "inputs": len(model.inputs),
        "delay": problem.delay,
    }


def _placed(transcription: Transcription) -> dict[str, Array]:
    """Where intervals are after a sample, and unknowns within them; what is known of sensors."""
    shift = Shift(transcription)
    values = {f"shift_{name}": getattr(shift, name) for name in ("stages", "shares", "intervals")}
    values |= {f"sensors_{name}": array for name, array in transcription.problem.sensors.arrays.items()}
    values["sensors_lead"] = np.full(len(transcription.problem.model.states), lead(transcription.discretization))
    return values | {"inner_signals": transcription.inner_signals, "inner_nodes": transcription.inner_nodes}
