"""`rumo bench`."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from rumo.checks import known_names
from rumo.cli.console import Json, Quiet, errors_in_words, print_json, print_report, words
from rumo.cli.progress import progress
from rumo.cli.sequence import end, incomplete


def bench(
    horizon: Annotated[int, typer.Option(min=2, help="Sampling intervals.")] = 15,
    steps: Annotated[int, typer.Option(min=100, help="Samples of the recorded drive.")] = 2000,
    scenario: Annotated[str, typer.Option(help="Which drive: easy (8 m/s) or limit (12 m/s).")] = "easy",
    sweep: Annotated[bool, typer.Option("--sweep", help="Horizons 15, 30, 50, 100 and both drives.")] = False,
    controllers: Annotated[str | None, typer.Option(help="Which, comma-separated; all that work if not given.")] = None,
    scheme: Annotated[
        str | None,
        typer.Option(
            help="Discretisation schemes, comma-separated: NAME or NAME:SUBSTEPS, or all, instead of controllers."
        ),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Measure how long a step takes. One recorded drive is replayed through every controller."""
    with errors_in_words():
        from rumo.bench import SCENARIOS
        from rumo.bench.report import report
        from rumo.bench.runners import available
        from rumo.registry import DISCRETIZATIONS

        chosen = list(DISCRETIZATIONS) if scheme == "all" else words(scheme)
        names = (available() if not chosen else []) if controllers is None else words(controllers)
        known_names(names or ["rti"], "--controllers", available())
        known_names([scenario], "--scenario", SCENARIOS)
        names = list(dict.fromkeys(["rti", *names]))
        solvers = not sweep and controllers is None and not chosen
        cases = [(drive, N) for drive in SCENARIOS for N in (15, 30, 50, 100)] if sweep else [(scenario, horizon)]
        runs: list[dict[str, Any]] = []
        stopped: BaseException | None = None
        try:
            with progress(quiet) as told:
                for done, case in enumerate(cases):
                    told("replay", done, len(cases))
                    _measure(runs, case, steps, names, chosen, solvers)
                told("replay", len(cases), len(cases))
        except (Exception, KeyboardInterrupt) as error:
            stopped = error
        if runs:
            measured = report(runs)
            if stopped is not None:
                done = f"{len(runs)} of {len(cases)} drives were replayed, the last perhaps in part"
                measured = incomplete(measured, done, stopped)
            if as_json:
                print_json(measured.summary)
            elif not quiet:
                print_report(measured)
        end(stopped)


def _measure(
    runs: list[dict[str, Any]], case: tuple[str, int], steps: int, names: list[str], chosen: list[str], solvers: bool
) -> None:
    """Add what comes of a drive and a horizon to the runs, also if it is interrupted."""
    from rumo.bench import measure, record, summary
    from rumo.bench.qp import installed, measure_solvers, record_programs
    from rumo.bench.report import solver_summary
    from rumo.bench.runners import summed_up
    from rumo.bench.schemes import schemes_of

    drive, N = case
    recording = record(drive, N, steps)
    replays: dict[str, list[Any]] = {}
    try:
        measure(recording, names, schemes_of(chosen, recording), replays)
    finally:
        if "rti" in replays:  # which all others are compared with
            runs.append(summary(summed_up(replays), N, drive))
    if solvers:
        runs[-1]["qp_solvers"] = solver_summary(measure_solvers(record_programs(recording), installed()))
