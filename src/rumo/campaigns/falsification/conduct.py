"""A falsification from its file to what it found."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from rumo.campaigns.conduct import engine_of, folder_of
from rumo.campaigns.falsification.falsify import Falsified, carry_out_falsification
from rumo.campaigns.falsification.reading import read_falsification, rehearse_falsification
from rumo.campaigns.falsification.specification import Falsification
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
        Folder of rows and logs; named as the file if not given, "falsify" without one.
    scheduler : str, optional
        Address of a Dask scheduler, "tcp://host:8786"; processes of this machine if not given.
    jobs : int, optional
        Drives at the same time on this machine; one a core if not given.
    serial : bool
        One drive after the other, in a process beside this one, without Dask.
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
    wanted = falsification_from(what)
    with (
        Store(folder_of(what, output, "falsify"), wanted.identity) as store,
        engine_of(scheduler, jobs, serial=serial) as engine,
    ):
        falsified = carry_out_falsification(wanted, engine, store, progress)
    if falsified.stopped is not None:
        raise falsified.stopped
    return falsified


def falsification_from(what: Falsification | str | Path) -> Falsification:
    """A falsification, or that of a file, all of whose drives can begin."""
    if isinstance(what, str | Path):
        return read_falsification(what)
    rehearse_falsification(checked(what, "what", Falsification))
    return what
