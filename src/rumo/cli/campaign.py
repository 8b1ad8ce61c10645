"""`rumo campaign`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rumo.cli.campaign_progress import campaign_progress
from rumo.cli.console import Json, Quiet, errors_in_words, print_note
from rumo.cli.sequence import end, write_report

if TYPE_CHECKING:
    from rumo.campaigns.engines import DaskEngine, SerialEngine

Output = Annotated[Path | None, typer.Option(help="Folder for rows, logs and report; named as the file if not given.")]
Scheduler = Annotated[
    str | None, typer.Option(help="Address of a Dask scheduler, tcp://host:8786; this machine's processes without.")
]
Workers = Annotated[int | None, typer.Option(min=1, help="Drives at the same time on this machine; one a core.")]
Serial = Annotated[bool, typer.Option("--serial", help="One drive after the other, without Dask.")]


def campaign(
    file: Annotated[Path, typer.Argument(help="TOML file: what varies, who drives, what is asked.")],
    output: Output = None,
    scheduler: Scheduler = None,
    jobs: Workers = None,
    serial: Serial = False,
    yes: Annotated[bool, typer.Option("--yes", help="Also if it takes longer than an hour.")] = False,
    retry_failed: Annotated[
        bool, typer.Option("--retry-failed", help="Make runs again that raised, crashed or took too long.")
    ] = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Drive a thousand times. What varies, who drives and what is asked is in a file; started again, it goes on."""
    with errors_in_words():
        from rumo.campaigns.conduct import campaign_from, conduct, engine_of, folder_of
        from rumo.campaigns.report.left import report_of
        from rumo.campaigns.specification.going_on import as_begun
        from rumo.campaigns.specification.reading import errors_of
        from rumo.campaigns.store import Store
        from rumo.errors import CampaignError

        folder = folder_of(file, output)
        wanted = as_begun(campaign_from(file), folder)
        stopped: BaseException | None = None
        with Store(folder, wanted.plain, wanted.identity) as store, engine_of(scheduler, jobs, serial=serial) as engine:
            tell_dashboard(engine, quiet)
            try:
                with campaign_progress(quiet) as tell, errors_of(file):
                    conduct(wanted, engine, store, tell, yes=yes, retry_failed=retry_failed)
            except (CampaignError, KeyboardInterrupt) as error:
                stopped = error
        found = report_of(folder, stopped)
        if found is not None:
            write_report(found, folder, as_json=as_json, quiet=quiet, stopped=stopped)
        end(stopped)


def tell_dashboard(engine: DaskEngine | SerialEngine, quiet: bool) -> None:
    """Where a browser shows what is going on, if anywhere."""
    if engine.address and not quiet:
        print_note(f"Dask's dashboard: {engine.address}")
