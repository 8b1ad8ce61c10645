"""Damping of the loop that a controller closes, by the linear law that it is where no constraint is active."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rumo.checks import checked
from rumo.discretization import Discretization, Radau3
from rumo.errors import PoorDampingWarning
from rumo.problem import Problem
from rumo.signals import Array, Values
from rumo.transcription import Transcription

EXACT = Radau3(substeps=4)
"""What stands for the model itself: over a sampling time, its error is far below any scheme's that is worth a look."""
VANISHED = 1e-4
"""Of a mode, after one sample: how it got there does not matter."""
STILL = 1e-6
"""Rate [per sample] of a mode that neither moves nor decays: a state that nothing acts on."""
LEAST, SHARE = 0.1, 0.5
"""Damping ratio, and share of the exact loop's, below which a scheme is warned of."""


@dataclass(frozen=True)
class LoopDamping:
    """The mode of a loop that is damped least.

    Attributes
    ----------
    ratio : float
        Its damping ratio: 1 for one that does not swing, 0 for one that swings for ever, negative for one that grows.
    frequency : float
        Its natural frequency [rad/s].
    radius : float
        Spectral radius of the loop over one sample: above 1 it is unstable.
    exact : float
        The ratio with an exact prediction.
    """

    ratio: float
    frequency: float
    radius: float
    exact: float


def damping(problem: Problem, scheme: Discretization, x: Values, u: Values) -> LoopDamping:
    """Least damping of the unconstrained MPC law, closed on the exact discretised model.

    The law minimises the problem's cost over a horizon that a scheme predicts; the plant is the same model, integrated
    exactly. Both are linearised at one state and input, where the system rests or moves steadily. Warns where the
    scheme leaves the loop under half of the damping that an exact prediction would, or under 0.1.

    Parameters
    ----------
    problem : Problem
        Its model, horizon, weights, blocks, delay and parameters; the plant has those of the first interval.
    scheme : Discretization
        Of the prediction.
    x : mapping or sequence, (nx,)
        State, in the states' units.
    u : mapping or sequence, (nu,)
        Input there.

    Returns
    -------
    LoopDamping

    Raises
    ------
    ArgumentError, ShapeError, UnknownNameError
        If x or u is not of this problem.
    numpy.linalg.LinAlgError
        If the model has no finite derivatives there, or the law no unique solution.

    Notes
    -----
    Eigenvalues e of the loop over a sample of length h mean modes of rate s = log(e) / h; the ratio is -Re(s) / |s|.
    """
    problem = checked(problem, "problem", Problem)
    state = problem.model.states.finite_vector(x, "x")
    held = problem.model.inputs.finite_vector(u, "u")
    nx, exact = len(state), Transcription(problem, EXACT)
    _, by_x, by_u = exact.response(state, held)
    loops = [
        _closed(by_x[:nx], by_u[:nx], _law(transcription, state, held), problem.delay)
        for transcription in (Transcription(problem, scheme), exact)
    ]
    ratio, frequency, radius = _least(loops[0], problem.sampling_time)
    found = LoopDamping(ratio, frequency, radius, _least(loops[1], problem.sampling_time)[0])
    _warn(found, problem, scheme)
    return found


def _warn(found: LoopDamping, problem: Problem, scheme: Discretization) -> None:
    begin = f"{problem.model.name}: the loop's least damping ratio is {found.ratio:.2g}, at {found.frequency:.2g} rad/s"
    if found.ratio < SHARE * found.exact:
        cure = "Take a scheme of higher order, such as rumo.Radau2(), or shorter intervals."
        message = f"{begin}, by {type(scheme).__name__}, and {found.exact:.2g} by an exact prediction. {cure}"
    elif found.ratio < LEAST:
        message = f"{begin}, by its weights and horizon. Weigh rates more, or look further ahead."
    else:
        return
    warnings.warn(message, PoorDampingWarning, stacklevel=3)


def _law(transcription: Transcription, x: Array, u: Array) -> Array:
    """K (nu, nx + max(d, 1) nu): the command for a state and the inputs decided, relative to the operating point."""
    problem = transcription.problem
    nx, nu, d, blocks = len(x), len(u), problem.delay, problem.blocks
    known, free = nx + max(d, 1) * nu, len(blocks.lengths) * nu
    # Everything as a linear function of what is known, x and the inputs decided, and of the blocks' inputs.
    states, inputs = np.eye(nx, known + free), _inputs(problem)
    hessian = np.zeros((known + free, known + free))
    given = transcription.given(problem.parameters)
    cache: dict[bytes, tuple[Array, Array, Array, Array]] = {}
    for i in range(problem.horizon):
        key = given[i].tobytes() + problem.steps[i].tobytes()
        if key not in cache:
            w, by_x, by_u = transcription.response(x, u, given[i])
            nv = len(problem.model.variables)
            cache[key] = (by_x[:nv], by_u[:nv], *_output_slopes(transcription, w[:nv], u, given[i]))
        by_x, by_u, Cx, Cu = cache[key]
        variables = by_x @ states + by_u @ inputs[i]
        states = variables[:nx]
        y = Cx @ variables + Cu @ inputs[i]
        hessian += y.T @ (problem.output_weights[i][:, None] * y)
    # Without a delay, nothing is decided but the input held until now.
    last, values = inputs[d - 1] if d else np.eye(nu, known + free, nx), np.eye(free, known + free, known)
    for weight, value in zip(problem.block_move_weights, values.reshape(-1, nu, known + free), strict=True):
        hessian += (value - last).T @ (weight[:, None] * (value - last))
        last = value
    blocks_of_known = -np.linalg.solve(hessian[known:, known:], hessian[known:, :known])
    values = np.vstack([np.eye(known), blocks_of_known])
    return inputs[d] @ values


def _inputs(problem: Problem) -> Array:
    """Inputs on each interval (N, nu, columns), of what is known and of the blocks' inputs."""
    nx, nu, d = len(problem.model.states), len(problem.model.inputs), problem.delay
    decided = max(d, 1)
    columns = nx + (decided + len(problem.blocks.lengths)) * nu
    inputs = np.zeros((problem.horizon, nu, columns))
    for i in range(d):
        inputs[i, :, nx + i * nu : nx + (i + 1) * nu] = np.eye(nu)
    # The input before the first block is the last that is decided.
    first = nx + (decided - 1) * nu
    for i, shares in enumerate(problem.blocks.matrix, start=d):
        inputs[i, :, first:] = np.kron(shares, np.eye(nu))
    return inputs


def _output_slopes(transcription: Transcription, xz: Array, u: Array, given: Array) -> tuple[Array, Array]:
    """Derivatives of the tracked outputs by states and algebraic variables (ny, nx + nz) and by inputs (ny, nu)."""
    jacobian = transcription.outputs.jacobian()
    by_xz, by_u, _ = (value.full() for value in jacobian(xz, u, given, 0.0))
    return by_xz, by_u


def _closed(A: Array, B: Array, law: Array, delay: int) -> Array:
    """The loop over one sample: state, then inputs decided, oldest first."""
    nx, nu = B.shape
    size = law.shape[1]
    loop = np.zeros((size, size))
    loop[:nx, :nx] = A
    if delay:
        loop[:nx, nx : nx + nu] = B
        loop[nx:-nu, nx + nu :] = np.eye(size - nx - nu)
    else:
        loop[:nx] += B @ law
    loop[-nu:] = law
    return loop


def _least(loop: Array, sampling_time: float) -> tuple[float, float, float]:
    """Ratio and frequency [rad/s] of the mode that is damped least, and spectral radius."""
    values = np.linalg.eigvals(loop).astype(complex)
    rates: NDArray[np.complex128] = np.log(values[np.abs(values) > VANISHED])
    rates = rates[np.abs(rates) > STILL]
    radius = float(np.abs(values).max(initial=0.0))
    if not len(rates):
        return 1.0, 0.0, radius
    ratios = -rates.real / np.abs(rates)
    least = int(np.argmin(ratios))
    frequency = float(np.abs(rates[least]) / sampling_time)
    return float(ratios[least]), frequency, radius
