"""References: what the tracked outputs should do, and what lies ahead."""

from rumo.references.base import Held, OfTime, Preview, Reference, ReferenceLike, as_reference, start_reference
from rumo.references.deviations import deviations
from rumo.references.following import Following
from rumo.references.motion import Rolling
from rumo.references.path_tracking import PathTracking, RunningPathTracking
from rumo.references.paths import Path, PathPoints
from rumo.references.road import Road
from rumo.references.signals import Sampled, Sine
from rumo.references.sine_path import SinePath
from rumo.references.speed_limits import SpeedLimits, speed_profile, speeds_within
from rumo.references.speed_profile import SpeedProfile
from rumo.references.timed_path import Legs, TimedPath

__all__ = [
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
    "as_reference",
    "deviations",
    "speed_profile",
    "speeds_within",
    "start_reference",
]
