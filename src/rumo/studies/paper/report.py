"""What the paper claims, and what we measure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rumo.report.contents import Section
from rumo.report.tables import Table, number
from rumo.studies.kpis import POINT
from rumo.studies.looks import label
from rumo.studies.paper.charts import paper_charts

if TYPE_CHECKING:
    import xarray as xr


def sections(content: Mapping[str, Any], logs: Mapping[str, xr.Dataset]) -> list[Section]:
    """What is shown of a summary, and of the logs by controller name."""
    return [
        Section("How it drives", [controllers_table(content["controllers"])], brief=True),
        Section("The paper's claims", [claims_table(content["claims"])], brief=True),
        Section("Figures", paper_charts(logs) if logs else []),
    ]


def controllers_table(controllers: Mapping[str, Any]) -> Table:
    """How each controller drove, from a summary: a column for each."""
    runs = list(controllers.values())
    statuses = list(dict.fromkeys(status for run in runs for status in run["status_counts"]))
    rows = [
        *([f"{kpi.title} [{kpi.unit}]", *(number(run[kpi.key]) for run in runs)] for kpi in POINT.values()),
        *(
            [f"Step time, {words} [us]", *(number(run["step_time_us"][key]) for run in runs)]
            for key, words in (("mean", "mean"), ("p50", "median"), ("p99", "99 %"), ("max", "largest"))
        ),
        ["Deadline misses", *(number(run["deadline_misses"]) for run in runs)],
        *([f"Steps {status}", *(number(run["status_counts"].get(status, 0)) for run in runs)] for status in statuses),
    ]
    return Table(["", *map(label, controllers)], rows)


def claims_table(claims: Sequence[Mapping[str, Any]]) -> Table:
    """What the paper claims beside our figures, from a summary; times in microseconds, as in all tables."""
    return Table(["Claim", "Printed", "Ours", "Unit"], [_claim(**item) for item in claims], words=(0, 3))


def _claim(claim: str, printed: float | str, ours: float | None, unit: str) -> list[str]:
    if unit == "ms":
        printed = printed if isinstance(printed, str) else 1000 * printed
        ours, unit = None if ours is None else 1e3 * ours, "us"
    return [claim, number(printed), number(ours), "" if unit == "1" else unit]


def claims(controllers: Mapping[str, Any], steps: Mapping[str, int]) -> list[dict[str, Any]]:
    """The paper's claims beside our figures; None where a controller did not run.

    The paper's times are from an Apple M2 Max.
    """

    def figure(name: str, *keys: str, scale: float = 1.0) -> float | None:
        value: Any = controllers.get(name)
        for key in keys:
            value = None if value is None else value[key]
        return None if value is None else scale * value

    def ratio(above: float | None, below: float | None) -> float | None:
        return None if above is None or below is None else above / below

    nlp_mean = figure("nlp", "step_time_us", "mean", scale=1e-3)
    rti_mean = figure("rti", "step_time_us", "mean", scale=1e-3)
    nlp_rms = figure("nlp", "tracking_error_rms_after_2s_m")
    rti_rms = figure("rti", "tracking_error_rms_after_2s_m")
    rows = [
        ("Mean step time of the direct NLP", 106, nlp_mean, "ms"),
        ("Mean step time of the RTI", 15, rti_mean, "ms"),
        ("Mean step time, NLP over RTI", 7, ratio(nlp_mean, rti_mean), "1"),
        (
            "NLP steps that exceed the sampling period",
            100,
            ratio(figure("nlp", "deadline_misses", scale=100.0), steps.get("nlp")),
            "%",
        ),
        (
            "RTI steps that exceed the sampling period",
            "few",
            ratio(figure("rti", "deadline_misses", scale=100.0), steps.get("rti")),
            "%",
        ),
        ("The NLP tracks: RMS error after 2 s", "tracks", nlp_rms, "m"),
        ("The RTI tracks: RMS error after 2 s", "tracks", rti_rms, "m"),
        ("The RTI is not worse: RMS error, RTI over NLP", "about 1", ratio(rti_rms, nlp_rms), "1"),
    ]
    return [dict(zip(("claim", "printed", "ours", "unit"), row, strict=True)) for row in rows]
