"""What limits a plan, in words: stiffness, constraints, convergence; and how accurate its prediction is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from rumo.checks import checked
from rumo.discretization import Discretization
from rumo.discretization.growth import misjudged_mode
from rumo.discretization.stability import jacobians, spectra
from rumo.kernel import SLACK_TOLERANCE
from rumo.plan import Plan
from rumo.signals import Array, NamedArray
from rumo.status import Status
from rumo.transcription import Transcription

CONVERGED = 1e-6
"""Share of the inputs' ranges below which a step is as good as none, and its ratio to another says nothing."""
RK4_LIMIT = 2.785
"""Largest |lambda| dt at which RK4 is stable for a decaying mode."""


@dataclass(frozen=True, eq=False)
class Explanation:
    """Printed, it is a few sentences.

    Attributes
    ----------
    stiffness : ndarray, shape (N,)
        Largest |lambda| dt of each interval, lambda the eigenvalues of the model at its end; NaN without a prediction,
        and where the model has no value.
    active : dict of str to list of int
        Limits that the plan keeps to exactly, and at which stages.
    violated : dict of str to list of int
        Path constraints that it violates, and at which stages.
    sentences : tuple of str
        What is printed.
    """

    stiffness: Array
    active: dict[str, list[int]]
    violated: dict[str, list[int]]
    sentences: tuple[str, ...]

    def __str__(self) -> str:
        return "\n".join(self.sentences)


def explain(plan: Plan, scheme: Discretization) -> Explanation:
    """What limits a plan that was made with a scheme."""
    problem = checked(plan, "plan", Plan).problem
    outcome = plan.status.value if plan.status is plan.cause else f"{plan.status.value} {plan.cause.reason}"
    predicted = np.isfinite(plan.x.values).all()
    rates = _jacobians(plan) if predicted else np.full((problem.horizon, 1, 1), np.nan)
    stiffness = np.abs(spectra(rates)).max(axis=1) * problem.steps
    active = _stages(_active(plan))
    violated = _stages((violation.constraint, violation.stage) for violation in plan.violations)
    sentences = [f"Outcome: {outcome}"]
    if plan.rescued:
        sentences.append("Rescued: the iteration was not to be trusted; this is the nonlinear program's solution.")
    if predicted:
        sentences += _stiffest(stiffness, scheme)
        model = problem.model
        mode = misjudged_mode(scheme, rates, problem.steps, model.states.names, inputs=len(model.inputs))
        sentences += [] if mode is None else [f"Misjudged: {mode.described(scheme)}"]
        sentences.append(_integration(plan, scheme))
    if plan.conflict:
        sentences.append(f"In conflict: {'; '.join(plan.conflict)}.")
    elif np.isfinite(plan.constraints.values).all():
        sentences.append(f"At limits: {_listed(active)}.")
        sentences.append(f"Violated: {_listed(violated)}.")
    else:
        sentences.append(f"Inputs at limits: {_listed(active)}; path constraints are not known without a solution.")
    if np.isfinite(plan.diagnostics.step):
        sentences.append(_convergence(plan))
    return Explanation(stiffness, active, violated, tuple(sentences))


def local_error(plan: Plan, scheme: Discretization) -> NamedArray[Array]:
    """Error of each interval alone, from the plan's state at its beginning, estimated with twice as many substeps.

    Shape (N, nx); NaN where nothing was predicted, or the equations could not be solved. Source: Hairer, Norsett and
    Wanner (1993), ch. II.4 (Richardson extrapolation).
    """
    problem = checked(plan, "plan", Plan).problem
    transcriptions = [Transcription(problem, each) for each in (scheme, replace(scheme, substeps=2 * scheme.substeps))]
    parameters = transcriptions[0].given(problem.parameters)
    share = 2.0**scheme.order / (2.0**scheme.order - 1.0)
    errors = np.full((problem.horizon, len(problem.model.states)), np.nan)
    for k in range(problem.horizon if np.isfinite(plan.x.values).all() else 0):
        x, u, nx = plan.x.values[k], plan.u.values[k], errors.shape[1]
        try:
            coarse, fine = (each.advance(x, u, parameters[k])[0][:nx] for each in transcriptions)
            errors[k] = share * (coarse - fine)
        except np.linalg.LinAlgError:
            continue
    return NamedArray(problem.model.states, errors)


def _jacobians(plan: Plan) -> Array:
    """Of the model at the end of each interval (N, nx, nx), algebraic variables eliminated."""
    problem = plan.problem
    variables = np.hstack([plan.x.values[1:], plan.z.values])
    return jacobians(problem.model, variables, plan.u.values, problem.parameters)


def _stiffest(stiffness: Array, scheme: Discretization) -> list[str]:
    """Where the prediction is stiffest, and where the model has no value."""
    sentences, known = [], np.isfinite(stiffness)
    if known.any():
        stage = int(np.nanargmax(stiffness)) + 1
        needed = max(int(np.ceil(stiffness[stage - 1] / RK4_LIMIT)), 1)
        sentences.append(
            f"Stiffness: |lambda| dt is up to {stiffness[stage - 1]:.2g}, at stage {stage}; RK4 would need {needed} "
            f"{'steps' if needed > 1 else 'step'} in that interval, {type(scheme).__name__} takes {scheme.substeps}."
        )
    if not known.all():
        where = _ranges((np.flatnonzero(~known) + 1).tolist())
        sentences.append(
            f"No value: the model or its derivatives give no finite numbers at the states predicted for {where}; look "
            "for a division by zero, a root or a logarithm there."
        )
    return sentences


def _active(plan: Plan) -> Iterator[tuple[str, int]]:
    """Limits that a plan keeps to exactly: name and stage."""
    problem = plan.problem
    d, near, u = problem.delay, SLACK_TOLERANCE * problem.input_scales, plan.u.values
    moves = np.diff(u, axis=0, prepend=np.full((1, u.shape[1]), np.nan))
    limits = (
        ("at its lower bound", u, problem.numbers.input_lower[d:]),
        ("at its upper bound", u, problem.numbers.input_upper[d:]),
        ("moves as fast down as it may", moves, problem.move_lower),
        ("moves as fast up as it may", moves, problem.move_upper),
    )
    for words, values, limit in limits:
        for k, j in np.argwhere(np.abs(values[d:] - limit) <= near):
            yield f"{problem.model.inputs.names[j]} {words}", int(k) + d + 1
    for k, j in np.argwhere(np.abs(plan.constraints.values) <= SLACK_TOLERANCE * problem.constraint_scales):
        yield problem.constraints[j].name, int(k) + 1


def _integration(plan: Plan, scheme: Discretization) -> str:
    """How accurate the prediction is."""
    errors = np.abs(local_error(plan, scheme).values)
    span = np.ptp(plan.x.values, axis=0)
    relative = errors / np.where(span > 0.0, span, np.inf)
    if not np.isfinite(relative).all():
        return "Integration: the local error could not be estimated."
    k, j = np.unravel_index(np.argmax(relative), relative.shape)
    states, diagnostics = plan.problem.model.states, plan.diagnostics
    amount = f"{errors[k, j]:.2g} {states.units[j]}".removesuffix(" 1")
    words = (
        f"Integration: an interval's own error is largest in {states.names[j]}, {amount} at stage {k + 1}, "
        f"{100.0 * relative[k, j]:.2g} % of the state's range in the plan"
    )
    if np.isnan(diagnostics.integrator_residual):
        return f"{words}."
    within = "within" if diagnostics.integrated else "above"
    distance = f"{diagnostics.integrator_residual:.2g} of the inputs' reach from the dynamics"
    return f"{words}; the guess was {distance}, {within} tolerance."


def _convergence(plan: Plan) -> str:
    """How far the iteration has come."""
    diagnostics = plan.diagnostics
    words = f"Convergence: the last step was {diagnostics.step:.2g} of the inputs' ranges"
    if diagnostics.step < CONVERGED:
        words += ", as good as none"
    elif np.isfinite(diagnostics.contraction):
        words += f", {diagnostics.contraction:.2g} times the one before"
    if np.isfinite(diagnostics.command_error):
        words += f", and further ones would change the command by some {diagnostics.command_error:.2g} of its range"
    if np.isfinite(diagnostics.kkt_residual):
        words += f"; KKT residual {diagnostics.kkt_residual:.2g}"
    return f"{words}." + (" The iterations have not settled." if plan.cause is Status.UNTRUSTED else "")


def _stages(found: Iterator[tuple[str, int]]) -> dict[str, list[int]]:
    """Stages by name."""
    stages: dict[str, list[int]] = {}
    for name, stage in found:
        stages.setdefault(name, []).append(stage)
    return {name: sorted(each) for name, each in stages.items()}


def _listed(stages: dict[str, list[int]]) -> str:
    """Names and stages in words."""
    return "; ".join(f"{name} ({_ranges(each)})" for name, each in stages.items()) or "nothing"


def _ranges(stages: list[int]) -> str:
    """Stages in ascending order, those in a row as a range."""
    parts: list[list[int]] = []
    for stage in stages:
        if parts and stage == parts[-1][-1] + 1:
            parts[-1].append(stage)
        else:
            parts.append([stage])
    words = ", ".join(str(part[0]) if len(part) == 1 else f"{part[0]} to {part[-1]}" for part in parts)
    return f"stages {words}" if len(stages) > 1 else f"stage {words}"
