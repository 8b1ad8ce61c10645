"""`rumo tune`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated

import typer

from rumo.campaigns.standing import Searching, Standing
from rumo.cli.campaign import Output, Scheduler, Serial, Workers, tell_dashboard
from rumo.cli.campaign_progress import campaign_progress
from rumo.cli.console import Json, Quiet, errors_in_words
from rumo.cli.sequence import end, write_report

if TYPE_CHECKING:
    from rumo.campaigns.searching.search import Trial
    from rumo.campaigns.tuning import Tuning
    from rumo.campaigns.tuning.course import Tell


def tune(
    file: Annotated[Path, typer.Argument(help="TOML file: what may be chosen, for which drives, and what is wanted.")],
    output: Output = None,
    scheduler: Scheduler = None,
    jobs: Workers = None,
    serial: Serial = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Look for better settings. Weights, horizon, filters, whatever a file names; started again, it goes on."""
    with errors_in_words():
        from rumo.campaigns.conduct import engine_of, folder_of
        from rumo.campaigns.tuning.conduct import tuning_from
        from rumo.campaigns.tuning.course import carry_out_tuning
        from rumo.campaigns.tuning.report import report

        wanted, folder = tuning_from(file), folder_of(file, output)
        with engine_of(scheduler, jobs, serial=serial) as engine:
            tell_dashboard(engine, quiet)
            with campaign_progress(quiet) as tell:
                tuned = carry_out_tuning(wanted, folder, engine, _told(wanted, tell))
        write_report(report(tuned, folder), folder, as_json=as_json, quiet=quiet, stopped=tuned.stopped)
        end(tuned.stopped)


def _told(tuning: Tuning, tell: Callable[[Standing], object]) -> Tell:
    """Progress of trials as that of a campaign."""
    from rumo.campaigns.judging.columns import unit_of
    from rumo.report.tables import number

    begun, before = monotonic(), list[int]()

    def told(done: int, every: int, best: Trial | None) -> None:
        before.append(done)
        pairs = zip(tuning.objectives.values(), best.values if best else (), strict=False)
        words = ", ".join(f"{goal.name} {number(value)} {unit_of(goal.kpi)}".rstrip() for goal, value in pairs)
        tell(Searching(every, before[0], done, 0, monotonic() - begun, words))

    return told
