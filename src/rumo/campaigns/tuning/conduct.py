"""A tuning from its file to its best settings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rumo.campaigns.conduct import engine_of, folder_of
from rumo.campaigns.report.left import leave
from rumo.campaigns.searching.trial_storage import optuna_for
from rumo.campaigns.tuning.course import Tell, Tuned, carry_out_tuning
from rumo.campaigns.tuning.reading import read_tuning, rehearsed
from rumo.campaigns.tuning.specification import Tuning
from rumo.checks import checked


def tune(
    what: Tuning | str | Path,
    output: str | Path | None = None,
    *,
    scheduler: str | None = None,
    jobs: int | None = None,
    serial: bool = False,
    report: bool = True,
    progress: Tell | None = None,
) -> Tuned:
    """Look for better settings, or go on looking, and return what came of it.

    What is done is kept in the folder whatever happens: called again with the same tuning, this goes on, and comes to
    the same as one that was not stopped. With more `trials` it goes on beyond.

    Parameters
    ----------
    what : Tuning, str or Path
        The tuning, or its file.
    output : str or Path, optional
        Folder of rows, trials and report; named as the file if not given, "tune" without one.
    scheduler, jobs, serial, report
        See `rumo.campaign`.
    progress : callable, optional
        Called with (trials done, all trials, the best `Trial` so far or None) at the beginning and after each batch.

    Returns
    -------
    Tuned
        Its `recipe` has the best settings; they are in the folder's `best.toml` as well.

    Raises
    ------
    ArgumentError
        If a drive cannot begin, Optuna is missing, the folder or the storage has another tuning, or nobody answers at
        the scheduler's address.
    CampaignError
        If no more can be driven, or stored; if the drives without tuning fail. What is stored stays.
    """
    from rumo.campaigns.tuning.report import report as report_of

    wanted, folder = tuning_from(what), folder_of(what, output, "tune")
    with engine_of(scheduler, jobs, serial=serial) as engine:
        tuned = carry_out_tuning(wanted, folder, engine, progress)
    if report:
        leave(report_of(tuned, folder), folder, tuned.stopped)
    if tuned.stopped is not None:
        raise tuned.stopped
    return tuned


def tuning_from(what: Any) -> Tuning:
    """A tuning, or that of a file, all of whose drives can begin."""
    optuna_for("a tuning")
    return read_tuning(what) if isinstance(what, str | Path) else rehearsed(checked(what, "what", Tuning))
