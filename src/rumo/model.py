"""A model: named states, inputs and parameters, and its equations written with CasADi."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from math import inf
from typing import Any

import casadi as ca

from rumo.checks import SMALLEST, checked_items, printable
from rumo.errors import ArgumentError, UnknownNameError
from rumo.expressions import as_scalar, called
from rumo.signals import Array, NamedSymbols, Signals, Values

Expression = Callable[[NamedSymbols, NamedSymbols, NamedSymbols], Any]


@dataclass(frozen=True)
class Parameter:
    """A model parameter, constant over an interval of the horizon.

    Parameters
    ----------
    unit : str
        Unit, "1" for none.
    default : float
        Value where nothing else is given.
    lower, upper : float
        Values beyond which the equations mean nothing: a plant is not run with them.
    """

    unit: str
    default: float
    lower: float = -inf
    upper: float = inf

    def check(self, value: float, argument: str) -> None:
        """Raise, naming `argument`, for a value that means nothing."""
        if self.lower <= value <= self.upper:
            return
        if self.upper < inf:
            expected = f"a number from {self.lower:g} to {self.upper:g}"
        else:
            expected = "a positive number" if self.lower == SMALLEST else f"a number of at least {self.lower:g}"
        raise ArgumentError(argument, repr(value), expected)


@dataclass(frozen=True)
class Output:
    """A named quantity computed from the model.

    Parameters
    ----------
    unit : str
        Unit, "1" for none.
    expression : callable
        `(x, u, p) -> CasADi expression`, scalar.
    """

    unit: str
    expression: Expression


@dataclass(frozen=True)
class Algebraic:
    """A quantity without a derivative, given by an equation that it fulfils at every time.

    Parameters
    ----------
    unit : str
        Unit, "1" for none.
    equation : callable
        `(x, u, p) -> CasADi expression` that is zero; all equations together determine all algebraic variables
        (index 1).
    guess : float
        A value near which to look for the first one.
    """

    unit: str
    equation: Expression
    guess: float = 0.0


class Model:
    """Continuous-time model `xdot = f(x, z, u, p)`, `0 = g(x, z, u, p)` of any system.

    Parameters
    ----------
    states, inputs : mapping of str to str
        Unit of each signal, in vector order.
    dynamics : callable
        `(x, u, p) -> {state: time derivative}` with CasADi expressions; signals are attributes (`x.rate`), and so are
        algebraic variables, of x.
    parameters : mapping of str to Parameter, optional
        Constants that a new `Problem` can change without building the model anew.
    outputs : mapping of str to Output, optional
        Further quantities to track, constrain or measure.
    algebraic : mapping of str to Algebraic, optional
        Algebraic variables z and their equations g, for implicit discretisation schemes.
    name : str
        For logs and messages.

    Attributes
    ----------
    variables : Signals
        The states, then the algebraic variables.
    parameter_items : dict of str to Parameter
        The parameters as they were given.
    f, g : casadi.Function
        `(xz, u, p) -> xdot` and `(xz, u, p) -> g`, shapes (nx + nz,), (nu,), (np_,), (nx,) and (nz,); xz are the
        variables.

    Raises
    ------
    ArgumentError
        If names clash, a derivative is missing or unknown, an expression is not a scalar of x, u, p, or the algebraic
        equations cannot determine the algebraic variables.
    """

    def __init__(
        self,
        states: Mapping[str, str],
        inputs: Mapping[str, str],
        dynamics: Callable[[NamedSymbols, NamedSymbols, NamedSymbols], Mapping[str, Any]],
        parameters: Mapping[str, Parameter] | None = None,
        outputs: Mapping[str, Output] | None = None,
        algebraic: Mapping[str, Algebraic] | None = None,
        name: str = "model",
    ) -> None:
        parameters = checked_items(parameters, "parameters", Parameter, 'rumo.Parameter("kg", 1.0)')
        outputs = checked_items(outputs, "outputs", Output, 'rumo.Output("m", lambda x, u, p: ...)')
        algebraic = checked_items(algebraic, "algebraic", Algebraic, 'rumo.Algebraic("A", lambda x, u, p: ...)')
        self.name = printable(name, "name")
        self.states = Signals(states, "states")
        self.inputs = Signals(inputs, "inputs")
        self.parameters = Signals({key: item.unit for key, item in parameters.items()}, "parameters")
        self.outputs = Signals({key: item.unit for key, item in outputs.items()}, "outputs")
        self.algebraic = Signals({key: item.unit for key, item in algebraic.items()}, "algebraic")
        if not len(self.states):
            raise ArgumentError("states", "no state", "at least one")
        if not len(self.inputs):
            raise ArgumentError("inputs", "no input", "at least one")
        self._reject_shared_names()
        defaults = {key: item.default for key, item in parameters.items()}
        self.default_parameters: Array = self.parameters.finite_vector(defaults, "parameters")
        for key, item in parameters.items():
            item.check(item.default, f"parameters[{key!r}].default")
        self.parameter_items = parameters

        self.variables = Signals(dict(states) | {key: item.unit for key, item in algebraic.items()}, "states")
        guesses = {key: item.guess for key, item in algebraic.items()}
        self.algebraic_guess: Array = self.algebraic.finite_vector(guesses, "algebraic guesses")

        self._make_symbols()
        derivatives = called(dynamics, self.symbols, "dynamics")
        if not isinstance(derivatives, Mapping):
            raise ArgumentError("dynamics", type(derivatives).__name__, "a mapping from state to time derivative")
        for key in derivatives:
            self.states.index(key, "dynamics")
        missing = [state for state in self.states if state not in derivatives]
        if missing:
            raise ArgumentError("dynamics", f"no derivative of {', '.join(missing)}", "one for each state")
        rows = [self.scalar(derivatives[state], f"dynamics[{state!r}]") for state in self.states]
        equations = [self.written(item.equation, f"algebraic[{key!r}].equation") for key, item in algebraic.items()]
        self._reject_undetermined(equations)
        arguments, names = [self.xz, self.u, self.p], ["x", "u", "p"]
        self.f = ca.Function("f", arguments, [ca.vertcat(*rows)], names, ["xdot"])
        self.g = ca.Function("g", arguments, [ca.vertcat(ca.SX(0, 1), *equations)], names, ["residual"])
        self._outputs = {key: self.written(item.expression, f"outputs[{key!r}]") for key, item in outputs.items()}

    def _make_symbols(self) -> None:
        self.x, self.z, self.u, self.p = (
            ca.SX.sym(symbol, len(signals))
            for symbol, signals in (
                ("x", self.states),
                ("z", self.algebraic),
                ("u", self.inputs),
                ("p", self.parameters),
            )
        )
        self.xz = ca.vertcat(self.x, self.z)
        self._own = {s.element_hash() for s in ca.symvar(ca.vertcat(self.xz, self.u, self.p))}

    def __getstate__(self) -> dict[str, Any]:
        state = {name: value for name, value in vars(self).items() if name not in ("x", "z", "u", "p", "xz", "_own")}
        return state | {"_outputs": self.packed(self._outputs.values())}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._make_symbols()
        self._outputs = dict(zip(self.outputs, self.unpacked(state["_outputs"]), strict=True))

    def packed(self, expressions: Iterable[Any]) -> Any:
        """Scalar expressions of the model's symbols as a function, which can be pickled: symbols cannot."""
        return ca.Function("packed", [self.xz, self.u, self.p], [ca.vertcat(ca.SX(0, 1), *expressions)])

    def unpacked(self, function: Any) -> list[Any]:
        """The expressions that were packed, of this model's symbols."""
        expressions = function(self.xz, self.u, self.p)
        return [expressions[i] for i in range(function.size1_out(0))]

    @property
    def symbols(self) -> tuple[NamedSymbols, NamedSymbols, NamedSymbols]:
        """States (and algebraic variables), inputs and parameters, answering to their names."""
        return (
            NamedSymbols(self.variables, self.xz),
            NamedSymbols(self.inputs, self.u),
            NamedSymbols(self.parameters, self.p),
        )

    @property
    def signals(self) -> tuple[Signals, ...]:
        """States, algebraic variables, inputs, parameters and outputs."""
        return self.states, self.algebraic, self.inputs, self.parameters, self.outputs

    def expression(self, name: str, argument: str) -> Any:
        """CasADi expression of a state, algebraic variable or output; unknown names raise, naming `argument`."""
        if name in self.states:
            return self.x[self.states.index(name)]
        if name in self.algebraic:
            return self.z[self.algebraic.index(name)]
        if name in self._outputs:
            return self._outputs[name]
        cure = "Add it to the model's outputs if it is an expression."
        if name in self.inputs:
            cure = (
                f'Inputs are no outputs by themselves: outputs={{"...": rumo.Output(..., lambda x, u, p: u.{name})}}.'
            )
        raise UnknownNameError(argument, name, (*self.states, *self.algebraic, *self.outputs), cure)

    def jacobian(self) -> Any:
        """`(xz, u, p) -> J` (nx, nx), the derivative of xdot by x, algebraic variables eliminated."""
        arguments: list[Any] = [self.xz, self.u, self.p]
        by_x, by_z = ca.jacobian(self.f(*arguments), self.x), ca.jacobian(self.f(*arguments), self.z)
        g_x, g_z = ca.jacobian(self.g(*arguments), self.x), ca.jacobian(self.g(*arguments), self.z)
        J = by_x - by_z @ ca.solve(g_z, g_x) if len(self.algebraic) else by_x
        return ca.Function("jacobian", arguments, [ca.densify(J)], ["x", "u", "p"], ["J"])

    def unit(self, name: str) -> str:
        """Unit of any signal."""
        for signals in self.signals:
            if name in signals:
                return signals.unit(name)
        raise UnknownNameError("name", name, [key for signals in self.signals for key in signals])

    def parameter_vector(self, values: Values, argument: str = "parameters") -> Array:
        """Parameter values (np_,), finite, defaults where a mapping leaves one out."""
        return self.parameters.finite_vector(values, argument, self.default_parameters)

    def written(self, function: Expression, argument: str) -> Any:
        """`function(x, u, p)` of the model's symbols as a scalar; anything else raises, naming `argument`."""
        return self.scalar(called(function, self.symbols, argument), argument)

    def scalar(self, expression: Any, argument: str) -> Any:
        """`expression` as a 1 x 1 SX of x, u and p only; anything else raises, naming `argument`."""
        result = as_scalar(expression, argument)
        foreign = [s.name() for s in ca.symvar(result) if s.element_hash() not in self._own]
        if foreign:
            raise ArgumentError(
                argument,
                f"the foreign symbol {foreign[0]!r}",
                "an expression of the states, inputs and parameters",
                "Declare it as a parameter of the model.",
            )
        return result

    def depends(self, expression: Any) -> bool:
        """Whether some variable or input appears in an expression."""
        return bool(ca.depends_on(expression, ca.vertcat(self.xz, self.u)))

    def _reject_undetermined(self, equations: list[Any]) -> None:
        """Raise unless the algebraic equations determine the algebraic variables, by their structure."""
        if not equations:
            return
        structure = ca.jacobian_sparsity(ca.vertcat(*equations), self.z)
        if ca.sprank(ca.DM(structure, 1.0)) < len(equations):
            raise ArgumentError(
                "algebraic",
                f"equations that do not determine all of {', '.join(self.algebraic)}",
                "equations of index 1",
                "Each variable needs an equation of its own; differentiate those without one by time.",
            )

    def _reject_shared_names(self) -> None:
        seen: dict[str, str] = {}
        for signals in self.signals:
            for key in signals:
                if key in seen:
                    raise ArgumentError(
                        signals.role, f"the name {key!r}, also among the {seen[key]}", "names used once", "Rename one."
                    )
                seen[key] = signals.role

    def __repr__(self) -> str:
        return f"Model({self.name}: {len(self.states)} states, {len(self.inputs)} inputs)"
