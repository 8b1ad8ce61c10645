"""The plant's input within a sample, piece by piece."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rumo.actuation import Actuation
from rumo.actuation.timing import ActingInputs, in_samples
from rumo.signals import Array, Signals, read_only
from rumo.simulation.channel import Channel


@dataclass(frozen=True, eq=False)
class Piece:
    """A part of a sample.

    Attributes
    ----------
    begin, end : float
        Shares of the sample.
    mean, last : ndarray, shape (nu,)
        Input that the plant is given: its mean over the piece, and what it is at the end. Not to be written to.
    """

    begin: float
    end: float
    mean: Array
    last: Array


class ActuatedInputs:
    """What actuators make of commands, sample by sample.

    A dead time ends where a piece does; motions are given to the plant as means over short pieces, an error of second
    order in their length.

    Parameters
    ----------
    actuation : Actuation
        As it is.
    acting : ActingInputs
        When its commands act.
    inputs : Signals
        Of the controller's model.
    sampling_time : float
        [s].
    first : ndarray, shape (nu,)
        What the actuators have done before.
    """

    def __init__(
        self, actuation: Actuation, acting: ActingInputs, inputs: Signals, sampling_time: float, first: Array
    ) -> None:
        self._dt = sampling_time
        self._channels = [Channel(actuation.of(name), float(value)) for name, value in zip(inputs, first, strict=True)]
        self._late = [in_samples(float(rest)) for rest in acting.rest]
        self._commands: list[float] = first.tolist()
        longest = max(whole for whole, _ in self._late)
        self._past = deque([read_only(first)] * (longest + 1), maxlen=longest + 1)
        followed = all(actuation.of(name).follows_at_once for name in inputs)
        self._at_once = followed and not any(whole or share for whole, share in self._late)

    def over(self, applied: Array, stops: Sequence[float] = ()) -> list[Piece]:
        """The sample in which these commands (nu,) come first; `stops` are further shares at which pieces end."""
        if self._at_once and not stops:
            return [Piece(0.0, 1.0, applied, applied)]
        self._past.appendleft(read_only(applied))
        arriving = [float(self._past[whole][i]) for i, (whole, _) in enumerate(self._late)]
        begins = [share for _, share in self._late]
        changes = {
            begin for begin, new, old in zip(begins, arriving, self._commands, strict=True) if begin and new != old
        }
        ends, pieces = sorted({*stops, *changes, 1.0}), list[Piece]()
        for begin, end in zip([0.0, *ends], ends, strict=False):
            commands = [
                new if begin >= late else old for late, new, old in zip(begins, arriving, self._commands, strict=True)
            ]
            pieces += self._moved(commands, begin, end)
        self._commands = arriving
        return pieces

    def _moved(self, commands: list[float], begin: float, end: float) -> list[Piece]:
        """A part of the sample in which nothing arrives."""
        moving = list(zip(self._channels, commands, strict=True))
        count = max(channel.pieces(command, end - begin, self._dt) for channel, command in moving)
        ends = [begin + (end - begin) * i / count for i in range(1, count)] + [end]
        pieces = list[Piece]()
        for start, stop in zip([begin, *ends], ends, strict=False):
            mean = [channel.go(command, (stop - start) * self._dt) for channel, command in moving]
            pieces.append(Piece(start, stop, np.array(mean), np.array([channel.value for channel in self._channels])))
        return pieces


def mean_input(pieces: Sequence[Piece]) -> Array:
    """Mean of the input over a sample (nu,)."""
    if len(pieces) == 1:
        return pieces[0].mean
    return np.sum([(piece.end - piece.begin) * piece.mean for piece in pieces], axis=0)
