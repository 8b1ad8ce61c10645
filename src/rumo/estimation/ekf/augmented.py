"""The model of a filter: that of the controller, unknowns that drift, and what is measured of them."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from rumo.discretization import Discretization
from rumo.model import Algebraic, Model, Output, Parameter
from rumo.problem import Problem
from rumo.signals import Array, NamedSymbols, Signals
from rumo.terms import Weight
from rumo.transcription import Transcription


class AugmentedModel:
    """States x = (states of the model, unknown parameters, biases of measurements), over shares of a sample.

    Unknowns stay as they are but for noise. The dynamics are multiplied by one more parameter, the share of a sampling
    time that a step takes: a measurement may belong to a time between two samples.

    Parameters
    ----------
    problem : Problem
        Of the controller.
    measured : Signals
        States, algebraic variables and outputs of its model.
    unknown : sequence of str
        Parameters of its model that are states here.
    biased : sequence of str
        Measurements with a bias.
    discretization : Discretization, optional
        Implicit Euler if not given.

    Attributes
    ----------
    transcription : Transcription
        Of a problem over one sample, whose outputs are the measurements.
    known : ndarray of int
        Which parameters of the model are told, in order; the share of a sample follows them.
    """

    def __init__(
        self,
        problem: Problem,
        measured: Signals,
        unknown: Sequence[str],
        biased: Sequence[str],
        discretization: Discretization | None,
    ) -> None:
        model = problem.model
        self._model, self._measured, self._biased = model, measured, tuple(biased)
        self._unknown = [model.parameters.index(name) for name in unknown]
        self.known = np.array([i for i, name in enumerate(model.parameters) if name not in unknown], dtype=int)
        nx, self.size = len(model.states), len(model.states) + len(unknown) + len(biased)
        defaults = [float(model.default_parameters[i]) for i in self.known]
        augmented = Model(
            states={f"x{i}": "1" for i in range(self.size)},
            inputs={f"u{i}": "1" for i in range(len(model.inputs))},
            dynamics=lambda x, u, p: self._dynamics(x, u, p, nx),
            parameters={f"p{i}": Parameter("1", value) for i, value in enumerate((*defaults, 1.0))},
            algebraic={
                f"z{i}": Algebraic("1", lambda x, u, p, i=i: model.g(*self._arguments(x, u, p))[i], float(guess))
                for i, guess in enumerate(model.algebraic_guess)
            },
            outputs={
                f"y{j}": Output("1", lambda x, u, p, name=name: self._output(name, x, u, p))
                for j, name in enumerate(measured)
            },
            name=f"estimation of {model.name}",
        )
        self.transcription = Transcription(
            Problem(
                augmented,
                horizon=1,
                sampling_time=problem.sampling_time,
                track={f"y{j}": Weight(1.0) for j in range(len(measured))},
                moves={f"u{i}": Weight(1.0) for i in range(len(model.inputs))},
            ),
            discretization,
        )

    @property
    def sees_algebraic(self) -> bool:
        """Whether a measurement depends on algebraic variables."""
        model = self.transcription.problem.model
        rows = ca.vertcat(*self.transcription.problem.output_rows)
        return bool(len(model.algebraic)) and bool(ca.depends_on(rows, model.z))

    def parameters(self, told: Array, share: float = 1.0) -> Array:
        """What the transcription takes for p, from parameters of the model (np_,) and the share of a sample."""
        return np.append(told[self.known], share)

    def measurements(self) -> Any:
        """`(xz, u, p) -> y, H`: measurements (m,) and derivatives by x (m, n), algebraic variables eliminated."""
        model = self.transcription.problem.model
        arguments = [model.xz, model.u, model.p]
        y = ca.vertcat(*self.transcription.problem.output_rows)
        by_x = ca.jacobian(y, model.x)
        if len(model.algebraic):
            g = model.g(*arguments)
            by_x -= ca.jacobian(y, model.z) @ ca.solve(ca.jacobian(g, model.z), ca.jacobian(g, model.x))
        return ca.Function("measurements", arguments, [ca.densify(y), ca.densify(by_x)])

    def _arguments(self, x: NamedSymbols, u: NamedSymbols, p: NamedSymbols) -> list[Any]:
        """What functions of the controller's model take."""
        model, nx = self._model, len(self._model.states)
        xz = [x[f"x{i}"] for i in range(nx)] + [x[f"z{i}"] for i in range(len(model.algebraic))]
        parameters: list[Any] = [None] * len(model.parameters)
        for place, i in enumerate(self.known):
            parameters[i] = p[f"p{place}"]
        for place, i in enumerate(self._unknown):
            parameters[i] = x[f"x{nx + place}"]
        inputs = [u[f"u{i}"] for i in range(len(model.inputs))]
        return [ca.vertcat(ca.SX(0, 1), *part) for part in (xz, inputs, parameters)]

    def _dynamics(self, x: NamedSymbols, u: NamedSymbols, p: NamedSymbols, nx: int) -> dict[str, Any]:
        share = p[f"p{len(self.known)}"]
        rates = self._model.f(*self._arguments(x, u, p))
        return {f"x{i}": share * rates[i] if i < nx else ca.SX(0.0) for i in range(self.size)}

    def _output(self, name: str, x: NamedSymbols, u: NamedSymbols, p: NamedSymbols) -> Any:
        model = self._model
        own = ca.Function("own", [model.xz, model.u, model.p], [model.expression(name, "measured")])
        value = own(*self._arguments(x, u, p))
        if name not in self._biased:
            return value
        return value + x[f"x{self.size - len(self._biased) + self._biased.index(name)}"]


def shared_model(
    problem: Problem,
    measured: Signals,
    unknown: tuple[str, ...],
    biased: tuple[str, ...],
    discretization: Discretization | None,
) -> AugmentedModel:
    """One that is there already, if it was made of the same: it takes as long as many samples, and does not change."""
    key = (problem.model, problem.sampling_time, measured.names, unknown, biased, discretization)
    if not isinstance(discretization, Hashable):  # a scheme of the user's
        return AugmentedModel(problem, measured, unknown, biased, discretization)
    return _made(_Made(key, problem, measured))


@dataclass(frozen=True)
class _Made:
    """All that decides an augmented model, and what it is made of."""

    key: tuple[Model, float, tuple[str, ...], tuple[str, ...], tuple[str, ...], Discretization | None]
    problem: Problem = field(compare=False)
    measured: Signals = field(compare=False)


@lru_cache(maxsize=8)
def _made(made: _Made) -> AugmentedModel:
    _, _, _, unknown, biased, discretization = made.key
    return AugmentedModel(made.problem, made.measured, unknown, biased, discretization)
