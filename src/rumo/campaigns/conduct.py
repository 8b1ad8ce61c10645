"""A campaign from its file to its report."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rumo.campaigns.carrying_out import carry_out
from rumo.campaigns.engines import DaskEngine, SerialEngine
from rumo.campaigns.judging.kept import read_results
from rumo.campaigns.judging.summary import worst
from rumo.campaigns.pilots import pilots, require_known, require_short
from rumo.campaigns.report.left import reported
from rumo.campaigns.specification import Campaign
from rumo.campaigns.specification.going_on import as_begun
from rumo.campaigns.standing import Beginning, Standing
from rumo.campaigns.store import Store
from rumo.campaigns.tasks.task import Engine
from rumo.campaigns.work import WORK
from rumo.checks import checked
from rumo.errors import ArgumentError

if TYPE_CHECKING:
    import pandas as pd


def campaign(
    what: Campaign | str | Path,
    output: str | Path | None = None,
    *,
    scheduler: str | None = None,
    jobs: int | None = None,
    serial: bool = False,
    yes: bool = False,
    retry_failed: bool = False,
    report: bool = True,
    progress: Callable[[Standing], object] | None = None,
) -> pd.DataFrame:
    """Drive a campaign, or what is missing of it, and return its rows.

    What is done is kept in the folder whatever happens: called again with the same campaign, this goes on.

    Parameters
    ----------
    what : Campaign, str or Path
        The campaign, or its file.
    output : str or Path, optional
        Folder of rows, logs and report; named as the file if not given, "campaign" without one.
    scheduler : str, optional
        Address of a Dask scheduler, "tcp://host:8786"; processes of this machine if not given.
    jobs : int, optional
        Runs at the same time on this machine; one a core if not given.
    serial : bool
        One run after the other, in a process beside this one, without Dask.
    yes : bool
        Whether it may take longer than an hour.
    retry_failed : bool
        Make runs again that raised, crashed or took too long.
    report : bool
        Whether the folder gets `report.html` and `summary.json`, as by the command, also if something ends it early.
    progress : callable, optional
        Called with a `Standing` at the beginning and after each run.

    Returns
    -------
    pandas.DataFrame
        A row for each run, see the page on campaigns.

    Raises
    ------
    ArgumentError
        If the campaign cannot be driven, the folder has another one, nobody answers at the scheduler's address, or it
        would take longer than an hour and nobody has said `yes`; nothing is lost.
    CampaignError
        If no more runs can be carried out, or stored. What is stored stays.
    """
    folder = folder_of(what, output)
    wanted = as_begun(campaign_from(what), folder)
    with (
        reported(folder, wanted=report),
        Store(folder, wanted.plain, wanted.identity) as store,
        engine_of(scheduler, jobs, serial=serial) as engine,
    ):
        conduct(wanted, engine, store, progress, yes=yes, retry_failed=retry_failed)
    return read_results(folder).rows


def campaign_from(what: Campaign | str | Path) -> Campaign:
    """A campaign, or that of a file, all of whose drives can begin."""
    if isinstance(what, str | Path):
        return Campaign.from_toml(what)
    checked(what, "what", Campaign).rehearse()
    return what


def folder_of(what: Any, output: str | Path | None, usual: str = "campaign") -> Path:
    """Where rows go: where it is said, else in a folder named as the file, else in the usual one."""
    if output is not None:
        return Path(output)
    return Path(Path(what).stem) if isinstance(what, str | Path) else Path(usual)


def engine_of(scheduler: str | None, jobs: int | None, *, serial: bool = False) -> DaskEngine | SerialEngine:
    """What carries runs out.

    Raises
    ------
    ArgumentError
        If more than one is asked for, or nobody answers at the address.
    """
    if serial and (scheduler is not None or jobs is not None):
        raise ArgumentError("serial", "true beside scheduler or jobs", "one of them")
    if scheduler is not None and jobs is not None:
        raise ArgumentError("jobs", f"{jobs} beside a scheduler", "one of them", "Its workers say how many there are.")
    return SerialEngine() if serial else DaskEngine(scheduler, jobs)


def conduct(
    wanted: Campaign,
    engine: Engine,
    store: Store,
    tell: Callable[[Standing], object] | None = None,
    *,
    yes: bool = False,
    retry_failed: bool = False,
) -> None:
    """Drive what is missing, and keep the logs of the worst.

    Raises
    ------
    ArgumentError
        If a criterion asks for a figure, or a part of one, that such drives do not have, or all would take longer than
        an hour, and `yes` is not said. The first runs are kept.
    CampaignError
        See `carry_out`.
    """
    every = len(wanted.tasks)

    def tell_first(standing: Standing) -> None:
        if tell is not None and standing.done < every:
            tell(Beginning(**vars(standing)))

    first = pilots(wanted)
    begun = carry_out(WORK, wanted.common, first, engine, store, tell_first, every=every)
    rows = store.records({task["key"] for task in first})
    require_known(wanted.criteria.values(), rows)
    if not yes:
        there = store.keys(failed=not retry_failed)
        require_short(wanted, rows, max(every - len(there), 0), engine.workers)
    store.describe()
    carry_out(WORK, wanted.common, wanted.tasks, engine, store, tell, retry_failed=retry_failed, after=begun)
    keep_worst(wanted, engine, store)


def keep_worst(wanted: Campaign, engine: Engine, store: Store) -> None:
    """Make the worst runs again whose logs are not kept, and keep them."""
    results = read_results(store.folder)
    rows = [results.rows.iloc[row] for row in worst(results)]
    missing = {
        str(row["key"]): wanted.task(int(row["draw"]), str(row["controller"]))
        for row in rows
        if results.log_of(str(row["key"])) is None
    }
    tasks: list[Any] = [{**task, "log": True} for task in missing.values()]
    with closing(engine.rows(WORK, wanted.common, tasks)) as again:
        for row in again:
            if row.get("log") is not None:
                store.keep_log(row["key"], row["log"])
