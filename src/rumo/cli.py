"""The command `rumo`."""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table as RichTable
from rich.text import Text

import rumo
from rumo.errors import ArgumentError, PlantError, RumoError, UnknownNameError
from rumo.report.tables import Table, claims_table, controllers_table

if TYPE_CHECKING:
    from rumo.report.charts import Chart, Panels

app = typer.Typer(
    help=rumo.__doc__, no_args_is_help=True, add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False
)
study = typer.Typer(help="Run a study and write its report.", no_args_is_help=True)
app.add_typer(study, name="study")


@app.callback(invoke_without_command=True)
def main(
    version: Annotated[bool, typer.Option("--version", help="Print the version and exit.", is_eager=True)] = False,
) -> None:
    """Nonlinear model predictive control of stiff systems, road vehicles first."""
    if version:
        typer.echo(f"rumo {rumo.__version__}")
        raise typer.Exit


@app.command()
def models() -> None:
    """List the models that come with Rumo, with their signals and units."""
    from rumo.registry import MODELS

    for name, make in MODELS.items():
        model = make()
        grid = RichTable(box=None, show_header=False, pad_edge=False, title=name, title_justify="left")
        for signals in model.signals:
            if len(signals):
                row = (f"  {signals.role}", ", ".join(f"{key} [{signals.unit(key)}]" for key in signals))
                grid.add_row(*map(Text, row))
        Console().print(grid, "")


@app.command()
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
    with _errors_in_words():
        from rumo.bench import SCENARIOS, measure, record, summary
        from rumo.bench.qp_solvers import installed, measure_solvers, record_programs
        from rumo.bench.report import percentile_table, solver_summary, solver_table, sweep_table
        from rumo.bench.runners import available
        from rumo.bench.schemes import schemes_of
        from rumo.registry import DISCRETIZATIONS

        chosen = list(DISCRETIZATIONS) if scheme == "all" else _words(scheme)
        names = (available() if not chosen else []) if controllers is None else _words(controllers)
        for name in names:
            if name not in available():
                raise UnknownNameError("--controllers", name, available())
        if scenario not in SCENARIOS:
            raise UnknownNameError("--scenario", scenario, SCENARIOS)
        if json_file is not None:
            _writable(json_file.parent)
        names = list(dict.fromkeys(["rti", *names]))
        alone = not sweep and controllers is None and not chosen
        cases = [(drive, N) for drive in SCENARIOS for N in (15, 30, 50, 100)] if sweep else [(scenario, horizon)]
        runs: list[dict[str, Any]] = []
        with _progress() as progress:
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
            _print(sweep_table(runs), f"{title}; medians of preparation + feedback (ratio of the sum)")
        else:
            _print(percentile_table(runs[0]), f"{title}; N = {horizon}, {scenario}")
        if alone:
            _print(solver_table(runs[0]["qp_solvers"]), "QP solvers, cold, called from Python; microseconds")
        if json_file is not None:
            content = {"machine": runs[0]["machine"], "runs": runs} if sweep else runs[0]
            _write_json(content, json_file)


@study.command()
def paper(
    controllers: Annotated[str, typer.Option(help="Which controllers drive, comma-separated.")] = "rti,nlp,ltv",
    seed: Annotated[int, typer.Option(min=0, help="Seed of wind and noise.")] = 0,
    duration: Annotated[float, typer.Option(help="Length of the drive [s].")] = 24.0,
    output: Annotated[Path, typer.Option(help="Folder for logs, figures and report.")] = Path("out"),
) -> None:
    """The paper's case study: a car follows a sine path in wind, with noisy sensors."""
    with _errors_in_words():
        from rumo.report.charts import paper_charts
        from rumo.report.page import Section, write_page
        from rumo.report.paper import summary
        from rumo.simulation.log import save
        from rumo.studies import PaperStudy

        names = dict.fromkeys(name.strip() for name in controllers.split(","))
        settings = PaperStudy(tuple(names), seed, duration)
        folder = _writable(output)
        with _progress() as progress:
            tasks = {name: progress.add_task(name, total=None) for name in settings.controllers}
            logs: dict[str, Any] = {}
            for name in settings.controllers:
                drive = replace(settings, controllers=(name,))
                try:
                    logs |= drive.run(
                        lambda name, done, steps: progress.update(tasks[name], completed=done, total=steps)
                    )
                except PlantError as error:
                    # What was driven so far is kept.
                    if error.log is not None:
                        save(error.log, folder / f"log-{name}.nc")
                    raise
                save(logs[name], folder / f"log-{name}.nc")
            content = summary(logs)
            charts = paper_charts(logs)
            _write(content, charts, folder, progress)
            lead = (
                f"A car follows a sine path at {settings.path.speed:g} m/s for {duration:g} s in wind, with noisy, "
                f"filtered measurements; horizon {content['horizon']}, sampling period "
                f"{1e3 * content['sampling_time_s']:g} ms, seed {seed}."
            )
            sections = [
                Section("Results", [controllers_table(content["controllers"])]),
                Section("The paper's claims", [claims_table(content["claims"])]),
                Section("Figures", charts),
            ]
            page = write_page(folder / "report.html", "The paper's case study", lead, sections)
        _print(controllers_table(content["controllers"]), "How it drives")
        _print(claims_table(content["claims"]), "The paper's claims")
        Console().print(f"Report: {page}", soft_wrap=True, highlight=False)


@study.command()
def faults(
    controllers: Annotated[str, typer.Option(help="Which controllers drive, comma-separated.")] = "rti,nlp",
    seed: Annotated[int, typer.Option(min=0, help="Seed of wind and noise.")] = 0,
    gate: Annotated[bool, typer.Option(help="Hold back implausible measurements.")] = True,
    output: Annotated[Path, typer.Option(help="Folder for logs, figures and report.")] = Path("out"),
) -> None:
    """Five bad samples in a row: sensors and solvers that fail, and what becomes of the drive."""
    with _errors_in_words():
        from rumo.report.charts import label
        from rumo.report.faults import LAST_COLUMN, fault_panels, fault_sections, faults_table, summary
        from rumo.report.page import write_page
        from rumo.simulation.log import save
        from rumo.studies.faults import FaultStudy

        names = dict.fromkeys(name.strip() for name in controllers.split(","))
        settings = FaultStudy(tuple(names), seed=seed)
        if not gate:
            settings = replace(settings, gate=None)
        folder = _writable(output)
        with _progress() as progress:
            tasks = {name: progress.add_task(name, total=len(settings.faults)) for name in settings.controllers}
            drives = settings.run(lambda name, done, every: progress.update(tasks[name], completed=done, total=every))
            for name, by_fault in drives.items():
                for fault, drive in by_fault.items():
                    if drive.log is not None:
                        save(drive.log, folder / f"log-{name}-{fault}.nc")
            content = summary(settings, drives)
            figures = fault_panels(drives)
            _write(content, figures, folder, progress)
            lead = (
                f"A car follows a sine path at {settings.base.path.speed:g} m/s in wind, with noisy, unfiltered "
                f"measurements; after {settings.start:g} s come {settings.count} bad samples. Seed {seed}, "
                f"{'with' if gate else 'without'} the innovation gate."
            )
            page = write_page(folder / "report.html", "Faults", lead, fault_sections(content, figures), LAST_COLUMN)
        for name, outcomes in content["controllers"].items():
            _print(faults_table(outcomes), label(name))
        Console().print(f"Report: {page}", soft_wrap=True, highlight=False)


def _words(text: str | None) -> list[str]:
    return [word.strip() for word in text.split(",")] if text else []


@contextmanager
def _errors_in_words() -> Generator[None]:
    """An error of ours is one sentence on standard error and exit code 2."""
    try:
        yield
    except RumoError as error:
        Console(stderr=True).print(f"Error: {error}", style="bold red", soft_wrap=True, highlight=False, markup=False)
        raise typer.Exit(2) from None


def _writable(folder: Path) -> Path:
    """Create the folder and prove that files can be written there, before any work is done."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise ArgumentError(
            "--output", f"'{folder}' ({error.strerror})", "a folder that can be written", "Name another folder."
        ) from None
    return folder


def _write(content: Mapping[str, Any], figures: Sequence[Chart | Panels], folder: Path, progress: Progress) -> None:
    """A study's summary and figures."""
    from rumo.report.figures import write_figures

    _write_json(content, folder / "summary.json")
    task = progress.add_task("figures", total=len(figures))
    for figure in figures:
        write_figures([figure], folder)
        progress.advance(task)


def _write_json(content: Mapping[str, Any], path: Path) -> None:
    path.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def _progress() -> Progress:
    return Progress(
        TextColumn("{task.description:>8}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=Console(stderr=True),
        disable=not sys.stderr.isatty(),
    )


def _print(table: Table, title: str) -> None:
    rich_table = RichTable(title=title, title_justify="left")
    for i, head in enumerate(table.heads):
        rich_table.add_column(Text(head), justify="right" if i else "left", overflow="fold")
    for row in table.rows:
        rich_table.add_row(*map(Text, row))
    Console().print(rich_table)
