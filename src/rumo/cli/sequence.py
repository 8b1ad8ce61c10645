"""What every study's command does, in one order: run, keep logs, write summary, page and figures, tell."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import typer

from rumo.cli.console import print_error, print_json, print_lines, print_note, print_report, writable, write_json
from rumo.cli.interrupts import interrupts
from rumo.cli.progress import Told, progress
from rumo.errors import PlantError
from rumo.report.contents import Report
from rumo.studies.base import Key, Study, carry_out, nested

INTERRUPTED = 130
"""Exit code, as of all programs that SIGINT ends."""


def run_study(study: Study, output: Path, *, as_json: bool = False, quiet: bool = False) -> None:
    """Run a study and write its report to a folder; its tables and sentences, or its summary, on the terminal.

    If it is interrupted, or a plant fails, what was done until then is written all the same and says so.
    """
    folder = writable(output)
    with progress(quiet) as told:
        results, stopped = _results(study, folder, told)
        report = study.report(nested(results))
        if stopped is not None:
            if not quiet:
                print_note("Writing what has been done until here.")
            reason = "interrupted" if isinstance(stopped, KeyboardInterrupt) else str(stopped)
            done = f"Incomplete: {len(results)} of {len(study.runs())} runs were done, then: {reason}."
            report = replace(report, summary={**report.summary, "complete": False}, warning=done.replace("..", "."))
        _write(report, folder, told)
    if as_json:
        print_json(report.summary)
    elif not quiet:
        print_report(report)
        print_lines(["", f"Report: {folder / 'report.html'}"])
    if isinstance(stopped, KeyboardInterrupt):
        raise typer.Exit(INTERRUPTED)
    if stopped is not None:
        print_error(str(stopped))
        raise typer.Exit(2)


def _results(study: Study, folder: Path, told: Told) -> tuple[dict[Key, Any], BaseException | None]:
    """What came of the runs, and what stopped them before they were all done."""
    from rumo.simulation.log import save

    results: dict[Key, Any] = {}
    runs = study.runs()

    def keep(key: Key, log: Any) -> None:
        if study.keeps_logs and log is not None:
            save(log, folder / f"log-{'-'.join(map(str, key))}.nc")

    with interrupts() as interrupt:

        def tell(name: str, done: float, every: int) -> None:
            interrupt.check()
            told(name, done, every)

        try:
            for key, result in carry_out(runs, tell):
                interrupt.check()
                keep(key, getattr(result, "log", result))
                results[key] = result
        except (Exception, KeyboardInterrupt) as stopped:
            # What was driven so far is kept as well.
            keep(next((key for key in runs if key not in results), ()), getattr(stopped, "log", None))
            if not (interrupt.seen or isinstance(stopped, PlantError | KeyboardInterrupt)):
                raise
            return results, stopped if isinstance(stopped, PlantError) and not interrupt.seen else KeyboardInterrupt()
    return results, None


def _write(report: Report, folder: Path, told: Told) -> None:
    from rumo.report.figures import write_figures
    from rumo.report.page import write_page

    write_json(report.summary, folder / "summary.json")
    write_page(folder / "report.html", report)
    with interrupts() as interrupt:
        for i, figure in enumerate(report.figures):
            told("figures", i, len(report.figures))
            write_figures([figure], folder)
            interrupt.check()
    if report.figures:
        told("figures", len(report.figures), len(report.figures))
