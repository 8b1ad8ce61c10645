"""What is shown of the cases: one table with goals, sentences, and for each case its drives and figures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rumo.report.contents import Section
from rumo.report.tables import Table, number
from rumo.studies.kpis import KPIS
from rumo.studies.looks import label
from rumo.studies.roads.case import Conditions
from rumo.studies.roads.cases import CASES
from rumo.studies.roads.charts import case_charts

MET, MISSED = "met", "MISSED"
OWN = {
    "position_rms_m": "Position error\nafter 2 s, RMS [m]",
    "position_max_m": "largest\n[m]",
    "entry_km_h": "Clean entry\n[km/h]",
    "touched_at_km_h": "Touched at\n[km/h]",
    "left_at_km_h": "Left at\n[km/h]",
    "speed_m_s": "Speed\n[m/s]",
    "sideslip_max_deg": "Sideslip,\nlargest [degrees]",
    "lateral_deviation_max_after_3s_m": "The same\nafter 3 s [m]",
}
"""Heads of figures that only this study has."""
HEADS: dict[str, str] = (
    {kpi.key: f"{kpi.title}\n[{kpi.unit}]" for kpi in KPIS.values()} | {"distance_m": "Distance\n[m]"} | OWN
)
HIDDEN = ("outcome", "ended", "motion")
"""Parts of a drive that are no figures."""


def sections(content: Mapping[str, Any], results: Mapping[str, Any], conditions: Conditions) -> list[Section]:
    """What is shown of a summary, and of what came of the drives."""
    cases = content["cases"]
    return [
        Section("Figures and goals", [goals_table(cases), *findings(content)], brief=True),
        *(
            Section(
                case["title"],
                [
                    case["told"],
                    *case_charts(name, CASES[name], results[name], conditions),
                    drives_table(case),
                    *_ended(case),
                ],
            )
            for name, case in cases.items()
        ),
    ]


def goals_table(cases: Mapping[str, Any]) -> Table:
    """Every figure of every case, with its goal, and whether each controller meets it."""
    names = list(dict.fromkeys(name for case in cases.values() for name in case["rows"]))
    rows: list[list[str]] = []
    for case in cases.values():
        by_figure: dict[str, dict[str, Any]] = {}
        for name, found in case["rows"].items():
            for row in found:
                by_figure.setdefault(row["figure"], {})[name] = row
        for i, (figure, found) in enumerate(by_figure.items()):
            some = next(iter(found.values()))
            cells = [_cell(found.get(name)) for name in names]
            rows.append(["" if i else case["title"], figure, some["unit"], _goal(some["goal"]), *cells])
    heads = ["", "Figure", "Unit", "Goal", *(label(name) for name in names)]
    return Table(heads, rows, words=(0, 1, 2))


def findings(content: Mapping[str, Any]) -> list[str]:
    """What each controller meets and misses, what the RTI loses that the NLP holds, and what was left out."""
    cases, told = content["cases"], list[str]()
    for name in dict.fromkeys(name for case in cases.values() for name in case["rows"]):
        found = [(case["title"], row) for case in cases.values() for row in case["rows"].get(name, ())]
        judged = [(title, row) for title, row in found if row["met"] is not None]
        missed = [f"{title}: {_lower(row['figure'])} {_value(row)}" for title, row in judged if not row["met"]]
        text = f"{label(name)} meets {len(judged) - len(missed)} of {len(judged)} goals"
        told.append(f"{text}; it misses {'; '.join(missed)}." if missed else f"{text}.")
    lost = [
        f"{case['title']}, {variant}"
        for case in cases.values()
        for variant in held(case, "nlp")
        if case["drives"]["nlp"][variant].get("whole", True)  # of a part of a lap a whole one cannot be judged
        and variant in case["drives"].get("rti", {})
        and variant not in held(case, "rti")
    ]
    if any({"rti", "nlp"} <= set(case["drives"]) for case in cases.values()):
        told.append(
            f"RTI loses, where NLP does not: {'; '.join(lost)}." if lost else "RTI loses no drive that NLP holds."
        )
    told.extend(f"{CASES[name].title}: {why}" for name, why in content["left_out"].items())
    return told


def held(case: Mapping[str, Any], controller: str) -> list[str]:
    """Drives of a case that a controller has brought to their end."""
    return [name for name, each in case["drives"].get(controller, {}).items() if each["outcome"] == "finished"]


def drives_table(case: Mapping[str, Any]) -> Table:
    """All drives of a case with their figures."""
    drives = [(name, variant, each) for name, found in case["drives"].items() for variant, each in found.items()]
    keys: list[str] = list(dict.fromkeys(str(key) for *_, each in drives for key in each if key not in HIDDEN))
    shown = [key for key in keys if any(isinstance(each.get(key), int | float) for *_, each in drives)]
    shown = [key for key in shown if not any(isinstance(each.get(key), bool) for *_, each in drives)]
    heads = ["", "", "", *(HEADS.get(key, key) for key in shown)]
    rows = [
        [label(name), variant, each["outcome"], *(number(each.get(key)) for key in shown)]
        for name, variant, each in drives
    ]
    return Table(heads, rows, words=(0, 1, 2))


def _ended(case: Mapping[str, Any]) -> list[str]:
    """How drives ended that did not arrive."""
    return [
        f"{label(name)}, {variant}: {each['ended']}"
        for name, found in case["drives"].items()
        for variant, each in found.items()
        if each["outcome"] != "finished"
    ]


def _goal(goal: Mapping[str, Any] | None) -> str:
    if goal is None:
        return "-"
    return f"{'at least' if goal['at_least'] else 'at most'} {goal['limit']:g}"


def _cell(row: Mapping[str, Any] | None) -> str:
    if row is None:
        return "-"
    mark = {None: "", True: f", {MET}", False: f", {MISSED}"}[row["met"]]
    return f"{number(row['value'])}{mark}"


def _value(row: Mapping[str, Any]) -> str:
    text = "unknown" if row["value"] is None else f"{number(row['value'])} {row['unit']}".strip()
    return f"{text} ({row['note']})" if row["note"] else text


def _lower(text: str) -> str:
    return text[:1].lower() + text[1:]
