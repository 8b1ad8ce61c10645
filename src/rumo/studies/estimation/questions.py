"""What is asked of the estimators: a drive each, which one thing makes harder than the plain one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from rumo.estimation import ExtendedKalman, ExtraState
from rumo.simulation import Scenario, Sensors
from rumo.simulation.faults import Outliers

GROSS = {"p_x": 1.0, "p_y": 1.0, "psi": 0.1, "v_x": 2.0, "v_y": 2.0, "omega": 0.5}
"""Standard deviation of gross errors."""


@dataclass(frozen=True)
class Question:
    """A drive, and what the filter is told of it.

    Attributes
    ----------
    title : str
        The question.
    meaning : str
        A sentence that says what the drive is.
    gross : mapping of str to float
        Standard deviation of gross errors, by measurement; see `Outliers`.
    share : float
        Of the measurements, how many have one.
    begin : float
        From when on [s].
    off : mapping of str to float
        How far the first estimates are from where the car is.
    claimed : mapping of str to float
        Standard deviation that the filter is told of its first estimates.
    unmeasured : tuple of str
        States that no sensor measures.
    late : mapping of str to float
        Samples by which measurements are late, as the filter is told.
    extra : mapping of str to ExtraState
        Unknowns that are estimated besides.
    bounds : mapping of str to (float, float)
        What physics says of states and unknowns.
    """

    title: str
    meaning: str
    gross: Mapping[str, float] = field(default_factory=dict[str, float])
    share: float = 0.1
    begin: float = 0.0
    off: Mapping[str, float] = field(default_factory=dict[str, float])
    claimed: Mapping[str, float] = field(default_factory=dict[str, float])
    unmeasured: tuple[str, ...] = ()
    late: Mapping[str, float] = field(default_factory=dict[str, float])
    extra: Mapping[str, ExtraState] = field(default_factory=dict[str, ExtraState])
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict[str, tuple[float, float]])

    def kalman(self, kalman: ExtendedKalman, start: Mapping[str, float]) -> ExtendedKalman:
        """The filter of a car that is in the state `start`, as this question wants it."""
        first = {name: start[name] + self.off.get(name, 0.0) for name in self.claimed}
        noise = {name: value for name, value in kalman.noise.items() if name not in self.unmeasured}
        return replace(kalman, noise=noise, x=first, deviations=dict(self.claimed), late=self.late, extra=self.extra)

    def scenario(self, plain: Scenario) -> Scenario:
        """The drive without this question, made harder."""
        faults = (Outliers((self.begin, float("inf")), self.gross, self.share, plain.seed),) if self.gross else ()
        noise = {name: value for name, value in plain.sensors.noise.items() if name not in self.unmeasured}
        return replace(plain, sensors=Sensors(noise, tuple(noise), late=self.late), faults=faults)


QUESTIONS = {
    "plain": Question("Plain noise", "Sensors have the noise that the filter expects, and nothing else is amiss."),
    "outliers": Question(
        "Outliers",
        "From one second on, one measurement of ten has a gross error, each by itself: of 1 m, 0.1 rad, 2 m/s or "
        "0.5 rad/s, as a standard deviation.",
        gross=GROSS,
        begin=1.0,
    ),
    "first": Question(
        "Outliers from the first sample on",
        "The same, but the first readings, from which the estimate starts, may have gross errors too.",
        gross=GROSS,
    ),
    "bounds": Question(
        "A bound that physics gives",
        "The friction of the road is estimated besides, from 1 on, which it is. No road has more: the moving horizon "
        "is told.",
        extra={"mu": ExtraState(drift=0.1, deviation=0.3, start=1.0)},
        bounds={"mu": (0.05, 1.0)},
    ),
    "start": Question(
        "A wrong start",
        "Neither the heading nor the speed across is measured. The first heading is off by 0.4 rad, twice what the "
        "filter is told.",
        unmeasured=("psi", "v_y"),
        off={"psi": 0.4},
        claimed={"psi": 0.2, "v_y": 0.5},
    ),
    "late": Question(
        "Late measurements",
        "Positions come three samples late, and the filter is told.",
        claimed={"p_x": 0.4, "p_y": 0.4},
        late={"p_x": 3.0, "p_y": 3.0},
    ),
}
"""By name."""
