"""`rumo bench`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from rumo.cli.console import errors_in_words, print_table, progress_bars, words, writable, write_json
from rumo.errors import UnknownNameError


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
    json_file: Annotated[Path | None, typer.Option("--json", help="File for the figures.")] = None,
) -> None:
    """Measure how long a step takes: one recorded drive, replayed through every controller."""
    with errors_in_words():
        from rumo.bench import SCENARIOS, measure, record, summary
        from rumo.bench.qp_solvers import installed, measure_solvers, record_programs
        from rumo.bench.report import percentile_table, solver_summary, solver_table, sweep_table
        from rumo.bench.runners import available
        from rumo.bench.schemes import schemes_of
        from rumo.registry import DISCRETIZATIONS

        chosen = list(DISCRETIZATIONS) if scheme == "all" else words(scheme)
        names = (available() if not chosen else []) if controllers is None else words(controllers)
        for name in names:
            if name not in available():
                raise UnknownNameError("--controllers", name, available())
        if scenario not in SCENARIOS:
            raise UnknownNameError("--scenario", scenario, SCENARIOS)
        if json_file is not None:
            writable(json_file.parent)
        names = list(dict.fromkeys(["rti", *names]))
        alone = not sweep and controllers is None and not chosen
        cases = [(drive, N) for drive in SCENARIOS for N in (15, 30, 50, 100)] if sweep else [(scenario, horizon)]
        runs: list[dict[str, Any]] = []
        with progress_bars() as progress:
            task = progress.add_task("replay", total=len(cases))
            for drive, N in cases:
                recording = record(drive, N, steps)
                runs.append(summary(measure(recording, names, schemes_of(chosen, recording)), N, drive))
                if alone:
                    solved = measure_solvers(record_programs(recording), installed())
                    runs[-1]["qp_solvers"] = solver_summary(solved)
                progress.advance(task)
        title = f"Microseconds; {runs[0]['machine']['processor']}"
        if sweep:
            print_table(sweep_table(runs), f"{title}; medians of preparation + feedback (ratio of the sum)")
        else:
            print_table(percentile_table(runs[0]), f"{title}; N = {horizon}, {scenario}")
        if alone:
            print_table(solver_table(runs[0]["qp_solvers"]), "QP solvers, cold, called from Python; microseconds")
        if json_file is not None:
            content = {"machine": runs[0]["machine"], "runs": runs} if sweep else runs[0]
            write_json(content, json_file)
