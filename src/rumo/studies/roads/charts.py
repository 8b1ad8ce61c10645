"""Figures of a case: where the worst drive went, and how far every controller's was from its path."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from rumo.report.charts import Chart, Line, Look, Panels
from rumo.studies.drive.charts import ALONG, PROFILE, path_chart
from rumo.studies.kpis import Driven
from rumo.studies.looks import label, look
from rumo.studies.roads.case import CONES, Case, Conditions, Variant, by_variant
from rumo.studies.roads.outcome import RoadDrive

PATH = Look("#444444", "dot", 0.7)
THINNER = 0.5
"""Than lines of other studies: laps are long."""

Drives = Mapping[str, Mapping[Variant, RoadDrive]]
"""Of a case, by controller and variant."""


def case_charts(name: str, case: Case, drives: Drives, conditions: Conditions) -> list[Chart | Panels]:
    """The worst drive of the first controller on its road, and the same variant by all of them."""
    own = case.charts(name, drives)
    if own:
        return own
    first = next(iter(drives))
    worst = case.worst(by_variant(drives[first]))
    road, driven = case.scene(worst, conditions)
    seen: dict[str, Driven] = {}
    for controller, found in drives.items():
        motion = found[worst].motion if worst in found else None
        if motion is not None and motion.sizes["time"] > 1:
            seen[controller] = driven(motion)
    if not seen:
        return []
    title = f"{case.title}: {case.variant_words(worst)}"
    charts: list[Chart | Panels] = []
    shown = next(iter(seen))
    speed = seen[shown].motion("v_x", "v_y")
    if speed is not None:
        chart = path_chart(seen[shown], np.hypot(*speed), road.cones)
        title_of_path = f"{title}, by {label(shown)}, coloured by speed"
        lines = tuple(replace(line, name=case.marks) if line.name == CONES else line for line in chart.lines)
        if seen[shown].track is None or road.cones is not None:
            s = np.linspace(0.0, road.path.length, max(200, round(4.0 * road.path.length)))
            points = road.path.at(s)
            lines = (Line("Path", points.x, points.y, PATH), *lines)
        charts.append(replace(chart, key=f"{name}-path", title=title_of_path, lines=lines))
    charts.append(_deviations(f"{name}-deviations", title, seen))
    return charts


def _deviations(key: str, title: str, seen: Mapping[str, Driven]) -> Panels:
    """Distance from the path, and speed, of each controller."""
    beside: list[Line] = []
    speeds: list[Line] = []
    for controller, drive in seen.items():
        usual = look(controller)
        s, look_of = drive.deviations["progress"], replace(usual, width=THINNER * usual.width)
        beside.append(Line(label(controller), s, drive.deviations["lateral_deviation"], look_of))
        v = drive.motion("v_x", "v_y")
        if v is not None:
            speeds.append(Line(label(controller), s, np.hypot(*v), look_of))
    some: Any = next(iter(seen.values()))
    if some.profile is not None:
        s = some.deviations["progress"]
        speeds.append(Line("Wanted", s, some.profile.speed_at(s), PROFILE))
    panels = (("Lateral deviation [m], positive to the left", tuple(beside)), ("Speed [m/s]", tuple(speeds)))
    return Panels(key, title, ALONG, "", panels, shared="x", height=1.7, across=1)
