"""How a car drove: the report."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from rumo.report.contents import Section
from rumo.report.tables import Table, number
from rumo.studies.drive.charts import WHEELS, drive_charts
from rumo.studies.drive.roads import DrivenRoad
from rumo.studies.drive.run import LATE, LOST
from rumo.studies.kpis import CONSTRAINTS, INPUTS, KPIS, MOTION, PLACE, STEPS, Driven, Kpi

BRIEF = (
    *("lap_time", "profile_time", "lap_time_over_profile", "distance"),
    *("lateral_deviation_rms", "lateral_deviation_p95", "lateral_deviation_max", "yaw_deviation_rms"),
    *("speed_deviation_rms", "time_off_track", "least_room"),
    *("lateral_acceleration_max", "jerk_rms", "friction_use_max", "input_activity"),
    *("step_time", "deadline_misses", "fallbacks", "status_counts", "nis", "nis_expected"),
)
"""What is on the terminal."""
ROOMS = {"Path and track": PLACE, "Car and tyres": MOTION, "Inputs": INPUTS, "Constraints": CONSTRAINTS, "Steps": STEPS}


def sections(
    content: Mapping[str, Any], drive: Driven, road: DrivenRoad, grip: float, mu: float | None
) -> list[Section]:
    """What is shown of a summary, and of a drive on a road at a grip."""
    found = content["kpis"]
    charts = drive_charts(drive, road, grip, mu) if drive.log.sizes["time"] > 1 else []
    brief = Table(["", "Value", "Unit"], _rows(found, [KPIS[name] for name in BRIEF]), words=(0, 2))
    told = [] if content["outcome"] in (LOST, LATE) else [content["ended"]]  # what went wrong is said before all else
    return [
        Section("How it drove", [brief, *told], brief=True),
        Section("Figures", charts),
        *(
            Section(heading, [Table(["", "Value", "Unit", "Meaning"], rows, words=(0, 2, 3))])
            for heading, room in ROOMS.items()
            if (rows := _rows(found, room.values(), meaning=True))
        ),
    ]


def _rows(found: Mapping[str, Any], wanted: Iterable[Kpi], *, meaning: bool = False) -> list[list[str]]:
    """A row for each figure that there is, or for each wheel, input, constraint or status of it."""
    rows: list[list[str]] = []
    for kpi in wanted:
        value = found[kpi.key]
        by_name: Mapping[str, Any] = value if isinstance(value, Mapping) else {"": value}
        for name, part in by_name.items():
            if part is not None:
                title = f"{kpi.title}, {WHEELS.get(name, name)}" if name else kpi.title
                unit = "" if kpi.unit == "1" else kpi.unit
                rows.append([title, number(part), unit, *([kpi.meaning] if meaning else [])])
    return rows
