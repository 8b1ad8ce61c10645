"""The smallest disturbance that violates a criterion, looked for by driving."""

from rumo.campaigns.falsification.conduct import falsify
from rumo.campaigns.falsification.falsify import Falsified, Tried
from rumo.campaigns.falsification.reading import read_falsification
from rumo.campaigns.falsification.shrinking import Found
from rumo.campaigns.falsification.specification import Falsification

__all__ = ["Falsification", "Falsified", "Found", "Tried", "falsify", "read_falsification"]
