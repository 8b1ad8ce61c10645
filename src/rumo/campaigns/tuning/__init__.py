"""Better settings, looked for by driving."""

from rumo.campaigns.tuning.conduct import tune
from rumo.campaigns.tuning.course import Judged, Tuned
from rumo.campaigns.tuning.goals import Limit, Objective
from rumo.campaigns.tuning.reading import read_tuning
from rumo.campaigns.tuning.specification import Check, Tuning

__all__ = ["Check", "Judged", "Limit", "Objective", "Tuned", "Tuning", "read_tuning", "tune"]
