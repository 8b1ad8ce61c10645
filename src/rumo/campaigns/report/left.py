"""The report that a campaign leaves in its folder, whatever ends it."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from rumo.campaigns.judging.kept import read_results
from rumo.campaigns.report.page import report
from rumo.campaigns.store.room import writing_to
from rumo.errors import ArgumentError, CampaignError
from rumo.report.contents import Report
from rumo.report.folder import write_pages


@contextmanager
def reported(folder: Path, *, wanted: bool = True) -> Generator[None]:
    """Have the folder of a campaign that is driven within the block a report of what is done at its end, if wanted."""
    stopped: BaseException | None = None
    try:
        yield
    except (CampaignError, KeyboardInterrupt) as error:
        stopped = error
    found = report_of(folder, stopped) if wanted else None
    if found is not None:
        leave(found, folder, stopped)
    if stopped is not None:
        raise stopped


def leave(report: Report, folder: Path, stopped: BaseException | None = None) -> CampaignError | None:
    """Write a report to its folder.

    Parameters
    ----------
    report : Report
        Of a campaign, a tuning or a falsification.
    folder : Path
        Where its rows are.
    stopped : BaseException, optional
        What has ended it early, which says more than that its report could not be written.

    Returns
    -------
    CampaignError or None
        Why it could not, if something had stopped the work before.

    Raises
    ------
    CampaignError
        If it could not, and nothing had.
    """
    try:
        with writing_to(folder):
            write_pages(report, folder)
    except CampaignError as error:
        if stopped is None:
            raise
        return error
    return None


def report_of(folder: Path, stopped: BaseException | None = None) -> Report | None:
    """The report of the campaign in a folder; None if it was stopped before anything was done.

    Parameters
    ----------
    folder : Path
        Of the campaign.
    stopped : BaseException, optional
        What ended it early.
    """
    try:
        results = read_results(folder)
    except ArgumentError:
        if stopped is None:
            raise
        return None
    return report(results, stopped)
