"""References: what the tracked outputs should do, and what lies ahead."""

from rumo.references.base import Held, OfTime, Preview, Reference, ReferenceLike, as_reference
from rumo.references.following import Following
from rumo.references.road import Road, speeds_within
from rumo.references.signals import Sampled, Sine
from rumo.references.sine_path import Rolling, SinePath

__all__ = [
    "Following",
    "Held",
    "OfTime",
    "Preview",
    "Reference",
    "ReferenceLike",
    "Road",
    "Rolling",
    "Sampled",
    "Sine",
    "SinePath",
    "as_reference",
    "speeds_within",
]
