"""Which line is fast: that of least time beside that of least curvature, and the centre line."""

from rumo.studies.race_line.lines import LINES, LineRun, TimedLine
from rumo.studies.race_line.minimum_time import MinimumTime, minimum_time
from rumo.studies.race_line.study import RaceLineStudy

__all__ = ["LINES", "LineRun", "MinimumTime", "RaceLineStudy", "TimedLine", "minimum_time"]
