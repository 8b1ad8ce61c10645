"""`rumo bench`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Annotated, Any

import typer

from rumo.checks import known_names
from rumo.cli.console import Json, Quiet, errors_in_words, print_json, print_report, words
from rumo.cli.progress import progress
from rumo.cli.sequence import end
from rumo.report.contents import Report
from rumo.report.folder import incomplete

HORIZONS = (15, 30, 50, 100, 200)
"""Of a sweep."""


def bench(
    horizon: Annotated[int, typer.Option(min=2, help="Sampling intervals.")] = 15,
    steps: Annotated[int, typer.Option(min=100, help="Samples of the recorded drive.")] = 2000,
    scenario: Annotated[
        str, typer.Option(help="Which drive: easy (8 m/s), limit (12 m/s), or weak (limit, inputs at bounds).")
    ] = "easy",
    sweep: Annotated[bool, typer.Option("--sweep", help="Horizons 15 to 200 and both drives.")] = False,
    width: Annotated[bool, typer.Option("--width", help="Models of 10 to 160 states instead.")] = False,
    controllers: Annotated[
        str | None, typer.Option(help="Which, comma-separated; the usual ones if not given.")
    ] = None,
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
        from rumo.bench import SCENARIOS, WEAK
        from rumo.bench.report import report
        from rumo.bench.runners import COMPILED, RUNNERS, USUAL, installed
        from rumo.bench.width import FAMILIES, measure_width, width_report
        from rumo.registry import DISCRETIZATIONS

        chosen = list(DISCRETIZATIONS) if scheme == "all" else words(scheme)
        works = [name for name in RUNNERS if installed(name)]
        usual = [] if chosen else [name for name in (COMPILED if sweep else USUAL) if name in works]
        names = usual if controllers is None else words(controllers)
        known_names(names or ["rti"], "--controllers", works)
        known_names([scenario], "--scenario", [*SCENARIOS, WEAK])
        names = list(dict.fromkeys(["rti", *names]))
        runs: list[dict[str, Any]] = []
        if width:
            sizes = [(name, states) for name, family in FAMILIES.items() for states in family.widths]
            measures = [lambda size=size: runs.append(measure_width(*size)) for size in sizes]
            _carry_out(measures, runs, width_report, as_json, quiet)
            return
        solvers = not sweep and controllers is None and not chosen
        cases = [(drive, N) for drive in SCENARIOS for N in HORIZONS] if sweep else [(scenario, horizon)]
        measures = [lambda case=case: _measure(runs, case, steps, names, chosen, solvers) for case in cases]
        _carry_out(measures, runs, report, as_json, quiet)


def _carry_out(
    measures: Sequence[Callable[[], None]],
    runs: list[dict[str, Any]],
    reported: Callable[[list[dict[str, Any]]], Report],
    as_json: bool,
    quiet: bool,
) -> None:
    """Measure, which adds to the runs, and tell what came of it, also if it is interrupted."""
    stopped: BaseException | None = None
    try:
        with progress(quiet) as told:
            for done, measure in enumerate(measures):
                told("replay", done, len(measures))
                measure()
            told("replay", len(measures), len(measures))
    except (Exception, KeyboardInterrupt) as error:
        stopped = error
    if runs:
        measured = reported(runs)
        if stopped is not None:
            done = f"{len(runs)} of {len(measures)} drives were replayed, the last perhaps in part"
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
    from rumo.bench.schemes import schemes_of

    drive, N = case
    recording = record(drive, N, steps)
    replays: dict[str, list[Any]] = {}
    try:
        measure(recording, names, schemes_of(chosen, recording), replays)
    finally:
        if "rti" in replays:  # which all others are compared with
            runs.append(summary(replays, recording, drive))
    if solvers:
        runs[-1]["qp_solvers"] = solver_summary(measure_solvers(record_programs(recording), installed()))
