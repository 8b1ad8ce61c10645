"""Where on the horizon the stages lie, and where on it inputs are free."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rumo.checks import as_list, checked, positive_number, whole_number
from rumo.errors import ArgumentError
from rumo.signals import Array


@dataclass(frozen=True)
class Grid:
    """Intervals of a horizon, of any lengths.

    Parameters
    ----------
    steps : sequence of float
        Length of each interval [s].
    """

    steps: Sequence[float]

    def __post_init__(self) -> None:
        listed = as_list(self.steps, "steps", "a list of interval lengths such as [0.05, 0.05, 0.1]")
        steps = tuple(positive_number(step, f"steps[{i}]") for i, step in enumerate(listed))
        object.__setattr__(self, "steps", steps)

    @classmethod
    def uniform(cls, intervals: int, step: float) -> Grid:
        """Intervals of one length [s]."""
        return cls.geometric(intervals, step, 1.0)

    @classmethod
    def geometric(cls, intervals: int, first: float, ratio: float, equal: int = 1) -> Grid:
        """Intervals that grow.

        Parameters
        ----------
        intervals : int
            Their number N.
        first : float
            Length of the first [s].
        ratio : float
            Length of each over that of the one before.
        equal : int
            Number of intervals at the beginning that are as long as the first; with a delay of d samples, at least
            d + 1.
        """
        intervals, equal = whole_number(intervals, "intervals", 1), whole_number(equal, "equal", 1)
        first, ratio = positive_number(first, "first"), positive_number(ratio, "ratio")
        with np.errstate(all="ignore"):  # Python's own power raises where it overflows
            growth = np.float64(ratio) ** np.maximum(np.arange(intervals) + 1 - equal, 0)
            return cls((first * growth).tolist())


@dataclass(frozen=True)
class MoveBlocks(ABC):
    """Fewer free inputs than intervals (Cagienard et al., 2007).

    Parameters
    ----------
    lengths : sequence of int
        Intervals in each block; together, all intervals whose input is free: N minus the delay.
    """

    lengths: Sequence[int]

    def __post_init__(self) -> None:
        listed = as_list(self.lengths, "lengths", "a list of block lengths such as [1, 1, 2, 4]")
        lengths = tuple(whole_number(length, f"lengths[{i}]", 1) for i, length in enumerate(listed))
        object.__setattr__(self, "lengths", lengths)

    @abstractmethod
    def shares(self) -> Array:
        """For each interval, the share of its block's value in the input; the rest is that of the block before."""

    @abstractmethod
    def moves(self) -> Array:
        """For each interval, its input's increment over that of its block's value."""

    @abstractmethod
    def parts(self) -> Array:
        """For each interval, the share of its input in the value that stands for its block."""

    @property
    def block_of(self) -> np.ndarray:
        """The block of each interval."""
        return np.repeat(np.arange(len(self.lengths)), self.lengths)

    @property
    def matrix(self) -> Array:
        """Inputs over the input before the first block and the blocks' values, shape (intervals, nb + 1)."""
        matrix, intervals = np.zeros((sum(self.lengths), len(self.lengths) + 1)), np.arange(sum(self.lengths))
        matrix[intervals, self.block_of + 1] = self.shares()
        matrix[intervals, self.block_of] = 1.0 - self.shares()
        return matrix

    def bounds(self, lower: Array, upper: Array) -> tuple[Array, Array]:
        """Lower and upper bounds of each block's value (nb, nu): those (intervals, nu) of all it has a share in."""
        intervals, blocks = np.nonzero(self.matrix[:, 1:])
        shape = len(self.lengths), lower.shape[1]
        lowest, highest = np.full(shape, -np.inf), np.full(shape, np.inf)
        np.maximum.at(lowest, blocks, lower[intervals])
        np.minimum.at(highest, blocks, upper[intervals])
        return lowest, highest

    def values(self, u: Array) -> Array:
        """The blocks' values (nb, nu) that stand for inputs (intervals, nu)."""
        return np.add.reduceat(self.parts()[:, None] * u, self.first)

    def _equally(self) -> Array:
        """For each interval, one over the length of its block."""
        return np.repeat(1.0 / np.array(self.lengths), self.lengths)

    @property
    def first(self) -> np.ndarray:
        """The first interval of each block."""
        return np.cumsum((0, *self.lengths[:-1]))


class InputBlocks(MoveBlocks):
    """Inputs stay within a block: they move only where a block begins."""

    def shares(self) -> Array:
        """All of it."""
        return np.ones(sum(self.lengths))

    def moves(self) -> Array:
        """All of it at the beginning of the block."""
        moves = np.zeros(sum(self.lengths))
        moves[self.first] = 1.0
        return moves

    def parts(self) -> Array:
        """Equal shares."""
        return self._equally()


class IncrementBlocks(MoveBlocks):
    """Increments stay within a block: inputs move by the same amount at each of its intervals."""

    def shares(self) -> Array:
        """A ramp that reaches the block's value at its last interval."""
        return np.concatenate([np.arange(1, length + 1) / length for length in self.lengths])

    def moves(self) -> Array:
        """Equal ones."""
        return self._equally()

    def parts(self) -> Array:
        """The last interval's alone."""
        parts = np.zeros(sum(self.lengths))
        parts[np.cumsum(self.lengths) - 1] = 1.0
        return parts


def stages_of(grid: Grid | None, horizon: int, sampling_time: float, delay: int) -> tuple[Array, Array]:
    """Length of each interval and time of each stage [s]."""
    if grid is None:
        if not np.isfinite(horizon * sampling_time):
            raise ArgumentError("sampling_time", f"{sampling_time:g} s", f"a time of which {horizon} have a sum")
        return np.full(horizon, sampling_time), sampling_time * np.arange(horizon + 1)
    steps = np.array(grid.steps)
    ahead = steps[: delay + 1]
    if not np.allclose(ahead, sampling_time, rtol=1e-9, atol=0.0):
        raise ArgumentError(
            "horizon",
            f"a grid that begins with steps of {', '.join(f'{step:g}' for step in ahead)} s",
            f"{len(ahead)} of the sampling time, {sampling_time:g} s",
            "Inputs of the first intervals are applied for a sampling time each: see Grid.geometric(equal=...).",
        )
    steps[np.isclose(steps, sampling_time, rtol=1e-9, atol=0.0)] = sampling_time
    with np.errstate(all="ignore"):
        times = np.concatenate([[0.0], np.cumsum(steps)])
        if not np.isfinite([times[-1], (steps / sampling_time).sum()]).all():
            raise ArgumentError(
                "horizon", f"steps of up to {steps.max():g} s", "steps whose sum, and ratio to the first, are numbers"
            )
    return steps, times


def blocks_of(blocks: MoveBlocks | None, horizon: int, delay: int) -> MoveBlocks:
    """The blocks of all intervals whose input is free; one for each if none are given."""
    free = horizon - delay
    if blocks is None:
        return InputBlocks([1] * free)
    blocks = checked(blocks, "blocks", MoveBlocks, "Write rumo.InputBlocks([1, 1, 2, 4]).")
    if sum(blocks.lengths) != free:
        raise ArgumentError(
            "blocks",
            f"{sum(blocks.lengths)} intervals in all",
            f"{free}: the horizon of {horizon} without the delay of {delay}",
        )
    return blocks
