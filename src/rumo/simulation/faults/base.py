"""A fault: something that goes wrong during some samples of a run. Data, not a callback."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import KW_ONLY, dataclass

import numpy as np

from rumo.controllers import Controller
from rumo.errors import ArgumentError
from rumo.model import Model
from rumo.signals import Array, Signals
from rumo.simulation.plant import Plant


@dataclass(frozen=True)
class Fault:
    """Base of all faults: it does nothing. A fault of your own overrides one of its methods.

    Parameters
    ----------
    when : range, or (float, float)
        The bad samples, counted from 0; or the time from which, and until which, samples are bad [s].
    """

    when: range | tuple[float, float]

    def __post_init__(self) -> None:
        if isinstance(self.when, range):
            if self.when.step != 1 or not 0 <= self.when.start <= self.when.stop:
                raise ArgumentError("when", repr(self.when), "samples one after the other, from 0 on")
            return
        try:
            start, end = (float(time) for time in self.when if not isinstance(time, str))
        except (TypeError, ValueError):
            raise ArgumentError(
                "when", repr(self.when), "range(first, end) of samples, or (start, end) in seconds"
            ) from None
        if not 0.0 <= start <= end or start == np.inf:
            raise ArgumentError("when", repr(self.when), "a start of at least 0 s, and an end after it")
        object.__setattr__(self, "when", (start, end))

    def samples(self, sampling_time: float) -> range:
        """The bad samples."""
        if isinstance(self.when, range):
            return self.when
        start, end = (time / sampling_time for time in self.when)
        # A sample belongs to the fault if it is at or after its start, and before its end; 1e-6 for rounding.
        return range(int(np.ceil(start - 1e-6)), int(np.ceil(min(end, 1e12) - 1e-6)))

    def check(self, measured: Signals, inputs: Signals) -> None:
        """Raise unless every name is one of what is measured, or of the controller's inputs."""

    def check_parameters(self, parameters: Signals) -> None:
        """Raise unless every name is one of the plant's parameters."""

    def sense(self, received: Array, past: Sequence[Array], bad: int, signals: Signals) -> Array:
        """What the estimator gets.

        Parameters
        ----------
        received : ndarray, shape (m,)
            What it would get without this fault.
        past : sequence of ndarray, each of shape (m,)
            What the sensors said, at each sample until now.
        bad : int
            How many bad samples came before this one.
        signals : Signals
            What is measured.
        """
        return received

    def act(self, applied: Array, past: Sequence[Array], bad: int, inputs: Signals) -> Array:
        """What the actuators do, from this sample to the next.

        Parameters
        ----------
        applied : ndarray, shape (nu,)
            What they would do without this fault.
        past : sequence of ndarray, each of shape (nu,)
            What they did before the first sample, and from each sample until now.
        bad : int
            How many bad samples came before this one.
        inputs : Signals
            Of the controller's model.
        """
        return applied

    @property
    def known(self) -> bool:
        """Whether controller and estimator know what becomes of commands; else they believe that all is well."""
        return False

    def disturb(self, given: Array, parameters: Signals) -> Array:
        """Parameters of the plant, from this sample to the next.

        Parameters
        ----------
        given : ndarray, shape (np_,)
            What they would be without this fault.
        parameters : Signals
            Of the plant.
        """
        return given

    @property
    def substitute(self) -> Model | Plant | None:
        """What is driven in place of the plant, from this sample to the next."""
        return None

    def around(self, controller: Controller) -> AbstractContextManager[object]:
        """A context for the controller's step."""
        return nullcontext()

    @property
    def runs(self) -> bool:
        """Whether the controller runs at all."""
        return True

    @property
    def lateness(self) -> int | None:
        """How many samples later than it should the command reaches the actuators; None if it never does."""
        return 0


@dataclass(frozen=True)
class Tellable(Fault):
    """A fault of commands or actuators, of which controller and estimator may be told.

    Parameters
    ----------
    told : bool
        They know what becomes of commands; else they believe that these arrive, and are done.
    """

    _: KW_ONLY
    told: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.told, bool):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise ArgumentError("told", repr(self.told), "True or False")

    @property
    def known(self) -> bool:
        """Whether controller and estimator are told."""
        return self.told
