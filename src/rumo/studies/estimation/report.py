"""What is shown of estimators: for each question a sentence of what was found, a table, a figure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rumo.report.contents import Section
from rumo.report.tables import Table, number
from rumo.studies.estimation.charts import chart
from rumo.studies.estimation.contenders import CONTENDERS
from rumo.studies.estimation.findings import finding
from rumo.studies.estimation.questions import QUESTIONS
from rumo.studies.estimation.summary import Results


def sections(content: Mapping[str, Any], results: Results) -> list[Section]:
    """A section for each question, and one on time."""
    found: list[Section] = []
    for question, asked in content["questions"].items():
        if not asked["estimators"]:
            continue
        figure = chart(question, content, results)
        said = f"{asked['meaning']} {finding(question, asked['estimators'])}".strip()
        shown = [] if figure is None else [figure]
        found.append(Section(asked["title"], [errors_table(question, asked), said, *shown], brief=True))
    return found


def errors_table(question: str, asked: Mapping[str, Any]) -> Table:
    """A row for each estimator, from a summary's entry of a question."""
    extra, bounds = QUESTIONS[question].extra, QUESTIONS[question].bounds
    heads = [
        "",
        "Position\n[m]",
        "worst\n[m]",
        "Heading\n[rad]",
        "v_x\n[m/s]",
        "v_y\n[m/s]",
        "Yaw rate\n[rad/s]",
        *(["Friction\n[1]"] if extra else []),
        *(["Beyond\nbound [%]"] if bounds else []),
        *(["Settled\nafter [s]"] if QUESTIONS[question].off else []),
        "NIS,\nof 1",
        "Path\n[m]",
        "Time,\nof EKF's",
        "Lost",
    ]
    rows: list[list[str]] = []
    for name, found in asked["estimators"].items():
        rmse = found["rmse"]
        rows.append(
            [
                CONTENDERS[name].title,
                number(rmse.get("position")),
                number(found["position_worst_m"]),
                *(number(rmse.get(signal)) for signal in ("psi", "v_x", "v_y", "omega")),
                *([number(rmse.get(signal)) for signal in extra]),
                *(["-" if found["beyond"] is None else f"{100.0 * found['beyond']:.0f}"] if bounds else []),
                *(
                    ["never" if found["settled_s"] is None else f"{found['settled_s']:.2f}"]
                    if QUESTIONS[question].off
                    else []
                ),
                "-" if not found["nis_expected"] else number(found["nis"] / found["nis_expected"]),
                number(found["lateral_deviation_rms_m"]),
                "-" if found["update_time_ratio"] is None else f"{found['update_time_ratio']:.3g}",
                f"{found['lost']}/{found['drives']}",
            ]
        )
    return Table(heads, rows)
