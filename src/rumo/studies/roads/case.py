"""A case of the study: drives, and what is said of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

from rumo.checks import positive_number, whole_number
from rumo.errors import ArgumentError
from rumo.report.charts import Chart, Panels
from rumo.studies.drive import DrivenRoad
from rumo.studies.kpis import Driven
from rumo.studies.roads.outcome import RoadDrive
from rumo.studies.roads.rows import Outcomes, Row

Variant = str | int | float
"""One of the drives of a case: a seed, the name of a track, a radius."""
Progress = Callable[[int, int], None]
CONES = "Cones"


@dataclass(frozen=True)
class Conditions:
    """What the cases have in common.

    Parameters
    ----------
    seeds : tuple of int
        Of wind and noise. Cases that are not driven with each of them take the first.
    tracks : tuple of str
        Names in `rumo.studies.drive.ROADS`, or files as `load_track` reads them.
    nlp_distance : float, optional
        How far the NLP drives on tracks [m]; whole laps if not given.

    Raises
    ------
    ArgumentError
        If a number cannot be, or two tracks have the same name.
    """

    seeds: tuple[int, ...] = (0, 1, 2, 3, 4)
    tracks: tuple[str, ...] = ("oval", "club", "eight")
    nlp_distance: float | None = None

    def __post_init__(self) -> None:
        if not self.seeds:
            raise ArgumentError("seeds", "none", "at least one, such as 0")
        for seed in self.seeds:
            whole_number(seed, "seeds", 0, most=float("inf"))
        if not self.tracks:
            raise ArgumentError("tracks", "none", "at least one name or file")
        names = [track_name(track) for track in self.tracks]
        twins = {name for name in names if names.count(name) > 1}
        if twins:
            raise ArgumentError("tracks", f"{min(twins)!r} more than once", "tracks of different names")
        if self.nlp_distance is not None:
            positive_number(self.nlp_distance, "nlp_distance")

    @property
    def files(self) -> dict[str, str]:
        """Tracks as they were given, by their names."""
        return {track_name(track): track for track in self.tracks}


def track_name(track: str) -> str:
    """A track's name, or a file's without folder and ending."""
    return FilePath(track).stem


class Case(ABC):
    """A case, by which controllers it is driven, and what is to come of it.

    Attributes
    ----------
    title : str
        For readers.
    told : str
        A sentence: what is driven.
    controllers : tuple of str
        Who drives it, if nobody is named.
    marks : str
        What the cones of its road are.
    """

    title: str
    told: str
    controllers: tuple[str, ...] = ("rti", "nlp")
    marks: str = CONES

    @property
    def lacking(self) -> str:
        """Why it cannot be driven here, in a sentence; nothing if it can."""
        return ""

    @abstractmethod
    def variants(self, conditions: Conditions) -> tuple[Variant, ...]:
        """Its drives."""

    def check(self, conditions: Conditions) -> None:
        """Raise for conditions under which it cannot be driven, before anything is."""

    @abstractmethod
    def drive(
        self, controller: str, variant: Variant, conditions: Conditions, progress: Progress | None = None
    ) -> RoadDrive:
        """One drive."""

    @abstractmethod
    def rows(self, controller: str, outcomes: Outcomes, conditions: Conditions) -> list[Row]:
        """What is said of a controller's drives."""

    @abstractmethod
    def worst(self, outcomes: Outcomes) -> Variant:
        """The drive that a figure is to show."""

    def variant_words(self, variant: Variant) -> str:
        """A drive of the case, for readers."""
        return f"seed {variant}" if isinstance(variant, int) else str(variant)

    @abstractmethod
    def scene(self, variant: Variant, conditions: Conditions) -> tuple[DrivenRoad, Callable[[Any], Driven]]:
        """What is driven on, and what makes a `Driven` of a log."""

    def charts(self, name: str, drives: Any) -> list[Chart | Panels]:
        """Figures of its own, of drives by controller and variant; none for those that every case has."""
        return []


def worst_by(outcomes: Outcomes, name: str) -> Variant:
    """The first drive that has no such figure, else the one of the largest."""
    for variant, each in outcomes.items():
        if each.get(name) is None:
            return variant
    return max(outcomes, key=lambda variant: outcomes[variant][name])


def by_variant(drives: Mapping[Variant, RoadDrive]) -> dict[Variant, dict[str, Any]]:
    """Outcomes of drives."""
    return {variant: drive.outcome for variant, drive in drives.items()}
