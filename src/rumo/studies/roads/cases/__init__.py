"""The cases by name, in the order of their table."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from rumo.studies.roads.case import Case
from rumo.studies.roads.cases.ice import Ice
from rumo.studies.roads.cases.moose import Moose
from rumo.studies.roads.cases.racer import Racer
from rumo.studies.roads.cases.rest import Rest
from rumo.studies.roads.cases.sine import Sine
from rumo.studies.roads.cases.tracks import Tracks

CASES: Mapping[str, Case] = MappingProxyType(
    {
        "sine-12": Sine(12.0, 0.025, 0.03),
        "sine-14": Sine(14.0, 0.035, None),
        "sine-15": Sine(15.0, None, 0.15),
        "tracks": Tracks(
            "Tracks, grip 0.9",
            "A lap of each track by the passenger car with four wheels and load transfer at 0.9 of its grip; wind, "
            "noise, a Kalman filter, a sample of delay.",
        ),
        "tracks-exact": Tracks(
            "Tracks, grip 0.95, exact state",
            "The same at 0.95 of its grip, its state known exactly.",
            grip=0.95,
            estimator="none",
            lateral=None,
            over=None,
        ),
        "tracks-limit": Tracks(
            "Tracks, grip 1, exact state",
            "The same at all of its grip, its state known exactly.",
            grip=1.0,
            estimator="none",
            goals=False,
        ),
        "multi-body": Tracks(
            "Tracks, multi-body car, grip 0.9",
            "The same laps by CommonRoad's multi-body model of vehicle 2, at 0.9 of its grip; noise, a Kalman "
            "filter, a sample of delay.",
            plant="commonroad-mb:2",
            lateral=None,
            over=None,
        ),
        "multi-body-exact": Tracks(
            "Tracks, multi-body car, grip 0.9, exact state",
            "The same, its state known exactly.",
            plant="commonroad-mb:2",
            estimator="none",
            lateral=None,
            over=None,
        ),
        "moose": Moose(65.0),
        "ice": Ice(),
        "rest": Rest(),
        "racer": Racer(),
    }
)
"""What is driven, by name."""
