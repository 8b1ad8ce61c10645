"""The report of a tuning."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rumo.campaigns.report.failures import LONGEST, WORDS, flattened
from rumo.campaigns.report.words import settings_words, value_words
from rumo.campaigns.tuning.course import Tuned
from rumo.campaigns.tuning.report.dependence import dependence_section
from rumo.campaigns.tuning.report.headline import headline, settings_section
from rumo.campaigns.tuning.report.history import history_section
from rumo.campaigns.tuning.summary import summary
from rumo.report.contents import Report, Section
from rumo.report.folder import incomplete
from rumo.report.tables import Table, number
from rumo.studies.looks import label


def report(tuned: Tuned, folder: str | Path) -> Report:
    """Sentences, tables and figures of what came of a tuning, and its summary.

    Parameters
    ----------
    tuned : Tuned
        What came of it.
    folder : str or Path
        Where it is kept, to be named.
    """
    content = summary(tuned, Path(folder).resolve().name)
    found = [
        headline(content),
        settings_section(content, str(folder)),
        history_section(content),
        dependence_section(content),
        failures_section(content),
        asked_section(content),
    ]
    sections = [section for section in found if section is not None]
    page = Report(f"Tuning {content['tuning']}", _lead(content), content, sections)
    if tuned.stopped is None:
        return page
    done = f"{len(tuned.trials)} of {tuned.tuning.trials} trials are done, and started again it goes on"
    return incomplete(page, done, tuned.stopped)


def _lead(content: Mapping[str, Any]) -> str:
    first = next(iter(content["objectives"].values()))
    drives, settings = first["tuning"]["drives"], ", ".join(content["settings"])
    trials, each = number(content["trials"]["done"]), "drives" if drives != 1 else "drive"
    by = label(content["controller"])
    return f"{trials} trials of {number(drives)} {each} each by {by}; what was chosen: {settings}."


def failures_section(content: Mapping[str, Any]) -> Section:
    """Drives that did not come to their end."""
    found = content["failures"]
    if not found:
        return Section("What went wrong", ["Every drive came to its end."])
    rows = [
        [
            WORDS.get(each["outcome"], ""),
            number(each["drives"]),
            each["message"][:LONGEST],
            settings_words(each["settings"]),
        ]
        for each in found
    ]
    return Section("What went wrong", [Table(["The drive", "Drives", "Such as", "At"], rows, words=(0, 2, 3))])


def asked_section(content: Mapping[str, Any]) -> Section:
    """What the tuning was told."""
    rows = [[name, value_words(value)[:LONGEST]] for name, value in flattened(content["specification"]).items()]
    return Section("What was asked", [Table(["Setting", "Value"], rows, words=(0, 1))])
