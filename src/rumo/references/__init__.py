"""References: what the tracked outputs should do, and what lies ahead."""

from rumo.references import generators, manoeuvres
from rumo.references.base import Held, OfTime, Preview, Reference, ReferenceLike, as_reference, start_reference
from rumo.references.deviations import deviations
from rumo.references.fastest import speed_profile, speeds_within
from rumo.references.following import Following
from rumo.references.loaders import load_race_line, load_track
from rumo.references.motion import Rolling
from rumo.references.path_tracking import PathTracking, RunningPathTracking
from rumo.references.paths import Path, PathPoints
from rumo.references.race_line import minimum_curvature
from rumo.references.road import Road
from rumo.references.signals import Sampled, Sine
from rumo.references.sine_path import SinePath
from rumo.references.speed_limits import SpeedLimits
from rumo.references.speed_profile import SpeedProfile
from rumo.references.timed_path import Legs, TimedPath
from rumo.references.tracks import TRACKS, Track

__all__ = [
    "TRACKS",
    "Following",
    "Held",
    "Legs",
    "OfTime",
    "Path",
    "PathPoints",
    "PathTracking",
    "Preview",
    "Reference",
    "ReferenceLike",
    "Road",
    "Rolling",
    "RunningPathTracking",
    "Sampled",
    "Sine",
    "SinePath",
    "SpeedLimits",
    "SpeedProfile",
    "TimedPath",
    "Track",
    "as_reference",
    "deviations",
    "generators",
    "load_race_line",
    "load_track",
    "manoeuvres",
    "minimum_curvature",
    "speed_profile",
    "speeds_within",
    "start_reference",
]
