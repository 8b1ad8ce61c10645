"""What a report leaves in a folder: the page, and the summary for machines."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any

from rumo.errors import RumoError
from rumo.files import write_whole
from rumo.interrupts import interruptible
from rumo.report.contents import Report

SUMMARY, PAGE = "summary.json", "report.html"


def write_pages(report: Report, folder: Path) -> None:
    """Write summary and page, which Ctrl-C does not keep from being written."""
    from rumo.report.page import write_page

    with interruptible(inf):
        text = as_json(report.summary) + "\n"
        write_whole(folder / SUMMARY, lambda place: place.write_text(text, encoding="utf-8"))
        write_page(folder / PAGE, report)


def as_json(content: Mapping[str, Any]) -> str:
    """A summary as text."""
    return json.dumps(content, indent=2, allow_nan=False)


def incomplete(report: Report, done: str, stopped: BaseException) -> Report:
    """A report that says first how much was done, and what ended it."""
    reason = str(stopped) if isinstance(stopped, RumoError) else f"{type(stopped).__name__}: {stopped}"
    if isinstance(stopped, KeyboardInterrupt):
        reason = "interrupted"
    warning = f"Incomplete: {done}, then: {reason.removesuffix('.')}."
    return replace(report, summary={**report.summary, "complete": False}, warning=warning)
