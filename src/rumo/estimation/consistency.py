"""Whether a filter's innovations are as large as it believes them to be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rumo.checks import as_names, checked, finite_number
from rumo.errors import ArgumentError
from rumo.estimation.innovation import Innovation
from rumo.signals import Array

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class ChannelConsistency:
    """Innovations of one measurement, over the standard deviations expected of them.

    Attributes
    ----------
    mean_square : float
        1 is expected.
    interval : (float, float)
        In which it is found with the confidence asked for, if the filter is right.
    mean : float
        0 is expected; a bias shows here.
    correlation : float
        Of one sample's with the next's; 0 is expected, and much more is model error rather than noise.
    used, refused : int
        How many measurements were used, and how many taken for outliers.
    """

    mean_square: float
    interval: tuple[float, float]
    mean: float
    correlation: float
    used: int
    refused: int


@dataclass(frozen=True)
class Consistency:
    """How a filter's innovations compare with what it expects (Bar-Shalom, Li, Kirubarajan, 2001, ch. 5.4).

    Attributes
    ----------
    nis : float
        Mean normalised innovation squared of a sample.
    expected : float
        Mean number of measurements used.
    interval : (float, float)
        In which `nis` is found with the confidence asked for, if the filter is right.
    samples : int
        With measurements used.
    channels : mapping of str to ChannelConsistency
        By measurement; each is judged by itself, with what is expected of it alone.
    """

    nis: float
    expected: float
    interval: tuple[float, float]
    samples: int
    channels: Mapping[str, ChannelConsistency]

    @property
    def consistent(self) -> bool:
        """Whether `nis` is in its interval; below it, the filter expects too much noise, above it too little."""
        return self.interval[0] <= self.nis <= self.interval[1]

    def __str__(self) -> str:
        low, high = self.interval
        lines = [f"NIS {self.nis:.2f}, expected {self.expected:.2f} ({low:.2f} to {high:.2f}), {self.samples} samples"]
        for name, c in self.channels.items():
            low, high = c.interval
            lines.append(
                f"{name}: mean square {c.mean_square:.2f} ({low:.2f} to {high:.2f}), mean {c.mean:+.2f}, "
                f"correlation {c.correlation:+.2f}, {c.used} used, {c.refused} refused"
            )
        return "\n".join(lines)


def consistency(
    source: xr.Dataset | Sequence[Innovation | None],
    measured: Sequence[str] = (),
    *,
    after: float = 0.0,
    confidence: float = 0.95,
) -> Consistency:
    """Compare innovations with what the filter expected.

    Parameters
    ----------
    source : xarray.Dataset, or sequence of Innovation or None
        A log, or what a filter's `innovation` was at each sample.
    measured : sequence of str
        Names of the measurements, where innovations are given.
    after : float
        From when on [s], in a log; from which sample on, of innovations.
    confidence : float
        Of the intervals, between 0 and 1.

    Raises
    ------
    ArgumentError
        If there are no innovations.
    """
    finite_number(after, "after")
    if not 0.0 < finite_number(confidence, "confidence") < 1.0:
        raise ArgumentError("confidence", f"{confidence:g}", "a number between 0 and 1")
    names, values, deviations, used, nis = _arrays(source, measured, after)
    if not used.any():
        raise ArgumentError("source", "no innovations", "those of a filter such as ExtendedKalman")
    counts = used.sum(axis=1)
    samples = int(np.count_nonzero(counts))
    normalised = np.where(used, values / deviations, np.nan)
    refused = np.isfinite(values) & ~used
    channels = {name: _channel(normalised[:, j], int(refused[:, j].sum()), confidence) for j, name in enumerate(names)}
    return Consistency(
        nis=float(nis[counts > 0].sum() / samples),
        expected=float(counts.sum() / samples),
        interval=_interval(int(counts.sum()), samples, confidence),
        samples=samples,
        channels=channels,
    )


def _channel(normalised: Array, refused: int, confidence: float) -> ChannelConsistency:
    known = normalised[np.isfinite(normalised)]
    if not len(known):
        nothing = float("nan")
        return ChannelConsistency(nothing, (nothing, nothing), nothing, nothing, 0, refused)
    pairs = normalised[:-1] * normalised[1:]
    pairs = pairs[np.isfinite(pairs)]
    square = float((known**2).mean())
    return ChannelConsistency(
        square,
        _interval(len(known), len(known), confidence),
        float(known.mean()),
        float(pairs.mean() / square) if len(pairs) else float("nan"),
        len(known),
        refused,
    )


def _interval(freedom: int, samples: int, confidence: float) -> tuple[float, float]:
    """In which the sum of so many squares of normal numbers, over a number of samples, is found."""
    from scipy.stats import chi2  # takes longer to import than all the rest

    tail = 0.5 * (1.0 - confidence)
    low, high = chi2.ppf([tail, 1.0 - tail], freedom) / samples
    return float(low), float(high)


def _arrays(source: Any, measured: Sequence[str], after: float) -> tuple[tuple[str, ...], Array, Array, Any, Array]:
    """Names, and of each sample: innovations, their deviations, which are used, NIS."""
    if hasattr(source, "data_vars"):
        late = source["time"].to_numpy() >= after
        values, deviations, used = (
            source[f"innovation{part}"].to_numpy()[late] for part in ("", "_deviation", "_used")
        )
        return (
            tuple(source["measurement"].to_numpy().tolist()),
            values,
            deviations,
            used > 0.0,
            source["nis"].to_numpy()[late],
        )
    names = as_names(measured, "measured")
    known = [checked(item, "source", Innovation) for item in list(source)[int(after) :] if item is not None]
    if any(len(item.values) != len(names) for item in known):
        raise ArgumentError("measured", repr(names), f"{len(known[0].values)} names, of the innovations")
    if not known:
        raise ArgumentError("source", "no innovations", "those of a filter such as ExtendedKalman")
    parts = zip(*((item.values, item.deviations, item.used, item.nis) for item in known), strict=True)
    values, deviations, used, nis = (np.array(part) for part in parts)
    return names, values, deviations, used, nis
