"""A falsification from its file to what it found."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from rumo.campaigns.conduct import engine_of, folder_of
from rumo.campaigns.falsification.falsify import Falsified, carry_out_falsification
from rumo.campaigns.falsification.reading import read_falsification, rehearse_falsification
from rumo.campaigns.falsification.specification import Falsification
from rumo.campaigns.report.left import leave
from rumo.campaigns.standing import Searching
from rumo.campaigns.store import Store
from rumo.checks import checked


def falsify(
    what: Falsification | str | Path,
    output: str | Path | None = None,
    *,
    scheduler: str | None = None,
    jobs: int | None = None,
    serial: bool = False,
    report: bool = True,
    progress: Callable[[Searching], object] | None = None,
) -> Falsified:
    """Look for the smallest disturbance that violates a criterion.

    What is driven is kept in the folder whatever happens: called again with the same falsification, this goes on, and
    ends as if it had not been stopped. One with more trials than before goes on, too.

    Parameters
    ----------
    what : Falsification, str or Path
        The falsification, or its file.
    output : str or Path, optional
        Folder of rows, logs and report; named as the file if not given, "falsify" without one.
    scheduler, jobs, serial, report
        See `rumo.campaign`.
    progress : callable, optional
        Called with a `Searching` at the beginning and after each batch.

    Raises
    ------
    ArgumentError
        If something cannot be driven, the folder has another falsification, or nobody answers at the scheduler's
        address.
    CampaignError
        If no more can be carried out, or stored; if the drive without disturbance violates something.
    """
    from rumo.campaigns.falsification.report import report as report_of

    wanted, folder = falsification_from(what), folder_of(what, output, "falsify")
    with (
        Store(folder, wanted.identity) as store,
        engine_of(scheduler, jobs, serial=serial) as engine,
    ):
        falsified = carry_out_falsification(wanted, engine, store, progress)
    if report:
        leave(report_of(falsified), folder, falsified.stopped)
    if falsified.stopped is not None:
        raise falsified.stopped
    return falsified


def falsification_from(what: Falsification | str | Path) -> Falsification:
    """A falsification, or that of a file, all of whose drives can begin."""
    if isinstance(what, str | Path):
        return read_falsification(what)
    rehearse_falsification(checked(what, "what", Falsification))
    return what
