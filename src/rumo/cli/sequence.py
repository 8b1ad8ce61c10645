"""What every study's command does, in one order: run, keep logs, write summary, page and figures, tell."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rumo.cli.console import print_error, print_json, print_lines, print_note, print_report, writable
from rumo.cli.progress import Told, progress
from rumo.interrupts import EXIT_CODE, interruptible
from rumo.report.contents import Report
from rumo.report.folder import PAGE, SUMMARY, incomplete, write_pages

if TYPE_CHECKING:
    from rumo.report.charts import Figure
    from rumo.studies.base import Key, Study

RESULTS = "results.jsonl"
"""What came of the runs of a study that can be resumed."""


def run_study(
    study: Study, output: Path, *, as_json: bool = False, quiet: bool = False, jobs: int = 1, resume: bool = False
) -> None:
    """Run a study and write its report to a folder; its tables and sentences, or its summary, on the terminal.

    Whatever ends it early, what was done until then is written and says so. A second Ctrl-C leaves out the figures.

    Parameters
    ----------
    study : Study
        Its settings.
    output : Path
        The folder.
    as_json, quiet : bool
        What is on the terminal.
    jobs : int
        Processes that do runs at the same time.
    resume : bool
        Leave out the runs of which the folder has what came of them; of a `Resumable` study.
    """
    folder = writable(output)
    with progress(quiet) as told:
        results, stopped = _results(study, folder, told, jobs, resume)
        if stopped is not None and not quiet:
            print_note("Writing what has been done until here.")
        try:
            report = _write(study, results, stopped, folder)
            _draw(report.figures, folder, told)
        except KeyboardInterrupt as interrupt:
            stopped = stopped or interrupt
            report = _write(study, results, stopped, folder)
    tell_report(report, folder, as_json=as_json, quiet=quiet)
    end(stopped)


def write_report(
    report: Report, folder: Path, *, as_json: bool, quiet: bool, stopped: BaseException | None = None
) -> None:
    """Summary and page, and what the terminal shows of them, of a command that something may have `stopped`.

    Raises
    ------
    CampaignError
        If they cannot be written, and nothing has stopped the command before.
    """
    from rumo.campaigns.report.left import leave

    failure = leave(report, folder, stopped)
    if failure is None:
        tell_report(report, folder, as_json=as_json, quiet=quiet)
    elif isinstance(stopped, KeyboardInterrupt):
        print_error(str(failure))


def tell_report(report: Report, folder: Path, *, as_json: bool, quiet: bool) -> None:
    """What the terminal shows of a report that is written."""
    if as_json:
        print_json(report.summary)
    elif not quiet:
        print_report(report)
        print_lines(["", f"Report: {folder / PAGE}"])


def end(stopped: BaseException | None) -> None:
    """End a command as what stopped it demands, when all that was done has been told."""
    if isinstance(stopped, KeyboardInterrupt):
        raise typer.Exit(EXIT_CODE)
    if stopped is not None:
        raise stopped


def _results(
    study: Study, folder: Path, told: Told, jobs: int, resume: bool
) -> tuple[dict[Key, Any], BaseException | None]:
    """What came of the runs, and what stopped them before they were all done."""
    from rumo.simulation.log import save
    from rumo.studies.base import Resumable, carry_out
    from rumo.studies.ledger import Ledger

    results: dict[Key, Any] = {}
    runs = study.runs()
    ledger = None
    if isinstance(study, Resumable):
        ledger = Ledger(folder / RESULTS, study.same, resume=resume)
        results |= {key: study.restored(ledger.done[key]) for key in runs if key in ledger.done}
    _clear(folder, logs=not resume)

    def keep(key: Key, log: Any) -> None:
        if study.keeps_logs and log is not None:
            save(log, folder / f"log-{'-'.join(map(str, key))}.nc")

    try:
        for key, result in carry_out({key: run for key, run in runs.items() if key not in results}, told, jobs):
            keep(key, getattr(result, "log", result))
            results[key] = result
            if ledger is not None and isinstance(study, Resumable):
                ledger.add(key, study.record(result))
    except (Exception, KeyboardInterrupt) as stopped:
        # What was driven so far is kept as well, if it can be.
        log = getattr(stopped, "log", None)
        if log is not None:
            key, log = next(key for key in runs if key not in results), log.assign_attrs(complete="no")
            with suppress(KeyboardInterrupt, OSError), interruptible(inf):
                keep(key, log)
            if study.takes_parts and log.sizes["time"]:
                results[key] = log
        return _in_order(results, runs), stopped
    return _in_order(results, runs), None


def _in_order(results: dict[Key, Any], runs: Iterable[Key]) -> dict[Key, Any]:
    return {key: results[key] for key in runs if key in results}


def _clear(folder: Path, *, logs: bool) -> None:
    """Delete what an earlier study has left in the folder, of which the summary will not tell."""
    from rumo.report.figures import ENDINGS
    from rumo.report.page import figures_of

    page = folder / PAGE
    figures = [folder / f"{key}.{ending}" for key in figures_of(page) for ending in ENDINGS]
    for path in (folder / SUMMARY, *(folder.glob("log-*.nc") if logs else ()), *figures, page):
        if path.is_file() and not path.is_symlink():  # what links lead to is written anew
            path.unlink()


def _write(study: Study, results: dict[Key, Any], stopped: BaseException | None, folder: Path) -> Report:
    """Summary and page, which a second Ctrl-C does not keep from being written."""
    from rumo.studies.base import nested

    with interruptible(inf):
        report = study.report(nested(results))
        if stopped is not None:
            done = sum(getattr(result, "attrs", {}).get("complete") != "no" for result in results.values())
            report = incomplete(report, f"{done} of {len(study.runs())} runs were done", stopped)
        write_pages(report, folder)
    return report


def _draw(figures: Sequence[Figure], folder: Path, told: Told) -> None:
    from rumo.report.figures import write_figures

    for i, figure in enumerate(figures):
        told("figures", i, len(figures))
        write_figures([figure], folder)
    if figures:
        told("figures", len(figures), len(figures))
