"""Cars on the road: manoeuvres and tracks with goals, each by one command."""

from rumo.studies.roads.case import Case, Conditions
from rumo.studies.roads.cases import CASES
from rumo.studies.roads.outcome import RoadDrive
from rumo.studies.roads.rows import Goal, Row
from rumo.studies.roads.study import RoadRun, RoadStudy

__all__ = ["CASES", "Case", "Conditions", "Goal", "RoadDrive", "RoadRun", "RoadStudy", "Row"]
