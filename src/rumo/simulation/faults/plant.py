"""Plants that are not what they were: wind, road, load."""

from __future__ import annotations

from dataclasses import dataclass

from rumo.checks import finite_number
from rumo.errors import ArgumentError
from rumo.model import Model
from rumo.signals import Array, Signals
from rumo.simulation.faults.base import Fault
from rumo.simulation.plant import Plant


@dataclass(frozen=True)
class Disturbed(Fault):
    """A parameter of the plant has another value, such as the wind in a gust, whatever its disturbance says.

    Parameters
    ----------
    parameter : str
        Of the plant.
    value : float
        In the parameter's unit.
    """

    parameter: str
    value: float

    def __post_init__(self) -> None:
        super().__post_init__()
        finite_number(self.value, "value")

    def check_parameters(self, parameters: Signals) -> None:
        """Raise for an unknown parameter."""
        parameters.index(self.parameter, "parameter")

    def disturb(self, given: Array, parameters: Signals) -> Array:
        """The value in place of the parameter's own."""
        given = given.copy()
        given[parameters.index(self.parameter)] = self.value
        return given


@dataclass(frozen=True)
class Changed(Fault):
    """The plant is another one for a while: another load or tyre. Its state is handed over as it is.

    Its parameters are its own where neither a disturbance nor another fault sets them.

    Parameters
    ----------
    plant : Model or Plant
        With the states, inputs and parameters of the plant whose place it takes. Sensors stay those of that one.
    """

    plant: Model | Plant

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.plant, Model | Plant):  # pyright: ignore[reportUnnecessaryIsInstance]
            expected = "a rumo.Model or a rumo.simulation.Plant"
            raise ArgumentError(
                "plant", repr(self.plant), expected, "Another road is another model of the same states."
            )

    @property
    def substitute(self) -> Model | Plant:
        """The other plant."""
        return self.plant
