"""`rumo falsify`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rumo.cli.campaign import Output, Scheduler, Serial, Workers, tell_dashboard
from rumo.cli.campaign_progress import campaign_progress
from rumo.cli.console import Json, Quiet, errors_in_words
from rumo.cli.sequence import end, write_report


def falsify(
    file: Annotated[Path, typer.Argument(help="TOML file: what may disturb, what its size is, what it is to violate.")],
    output: Output = None,
    scheduler: Scheduler = None,
    jobs: Workers = None,
    serial: Serial = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Look for the smallest disturbance that is too much. Gust, ice or dropout; started again, it goes on."""
    with errors_in_words():
        from rumo.campaigns.conduct import engine_of, folder_of
        from rumo.campaigns.falsification.conduct import falsification_from
        from rumo.campaigns.falsification.falsify import carry_out_falsification
        from rumo.campaigns.falsification.report import report
        from rumo.campaigns.store import Store

        wanted = falsification_from(file)
        with (
            Store(folder_of(file, output), wanted.identity) as store,
            engine_of(scheduler, jobs, serial=serial) as engine,
        ):
            tell_dashboard(engine, quiet)
            with campaign_progress(quiet) as tell:
                falsified = carry_out_falsification(wanted, engine, store, tell)
        write_report(report(falsified), falsified.folder, as_json=as_json, quiet=quiet, stopped=falsified.stopped)
        end(falsified.stopped)
