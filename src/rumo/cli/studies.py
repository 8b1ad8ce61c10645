"""`rumo study ...`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from rumo.checks import known_names
from rumo.cli.console import (
    errors_in_words,
    print_sentences,
    print_table,
    progress_bars,
    tasks,
    words,
    writable,
    write_study,
)
from rumo.errors import PlantError
from rumo.report.tables import claims_table, controllers_table

study = typer.Typer(help="Run a study and write its report.", no_args_is_help=True)


@study.command()
def paper(
    controllers: Annotated[str, typer.Option(help="Which controllers drive, comma-separated.")] = "rti,nlp,ltv",
    seed: Annotated[int, typer.Option(min=0, help="Seed of wind and noise.")] = 0,
    duration: Annotated[float, typer.Option(help="Length of the drive [s].")] = 24.0,
    output: Annotated[Path, typer.Option(help="Folder for logs, figures and report.")] = Path("out"),
) -> None:
    """The paper's case study: a car follows a sine path in wind, with noisy sensors."""
    with errors_in_words():
        from rumo.report.charts import paper_charts
        from rumo.report.page import Section, write_page
        from rumo.simulation.log import save
        from rumo.studies import PaperStudy
        from rumo.studies.paper.report import summary

        settings = PaperStudy(tuple(words(controllers)), seed, duration)
        folder = writable(output)
        with progress_bars() as progress:
            update = tasks(progress, settings.controllers)
            logs: dict[str, Any] = {}
            for name in settings.controllers:
                drive = replace(settings, controllers=(name,))
                try:
                    logs |= drive.run(update)
                except PlantError as error:
                    # What was driven so far is kept.
                    if error.log is not None:
                        save(error.log, folder / f"log-{name}.nc")
                    raise
                save(logs[name], folder / f"log-{name}.nc")
            content = summary(logs)
            charts = paper_charts(logs)
            write_study(content, charts, folder, progress)
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
        print_table(controllers_table(content["controllers"]), "How it drives")
        print_table(claims_table(content["claims"]), "The paper's claims")
        print_sentences([f"Report: {page}"])


@study.command()
def faults(
    controllers: Annotated[str, typer.Option(help="Which controllers drive, comma-separated.")] = "rti,nlp",
    seed: Annotated[int, typer.Option(min=0, help="Seed of wind and noise.")] = 0,
    gate: Annotated[bool, typer.Option(help="Hold back implausible measurements.")] = True,
    output: Annotated[Path, typer.Option(help="Folder for logs, figures and report.")] = Path("out"),
) -> None:
    """Five bad samples in a row: sensors and solvers that fail, and what becomes of the drive."""
    with errors_in_words():
        from rumo.report.charts import label
        from rumo.report.page import write_page
        from rumo.simulation.log import save
        from rumo.studies.faults import FaultStudy
        from rumo.studies.faults.report import LAST_COLUMN, fault_panels, fault_sections, faults_table, summary

        settings = FaultStudy(tuple(words(controllers)), seed=seed)
        if not gate:
            settings = replace(settings, gate=None)
        folder = writable(output)
        with progress_bars() as progress:
            drives = settings.run(tasks(progress, settings.controllers))
            for name, by_fault in drives.items():
                for fault, drive in by_fault.items():
                    if drive.log is not None:
                        save(drive.log, folder / f"log-{name}-{fault}.nc")
            content = summary(settings, drives)
            figures = fault_panels(drives)
            write_study(content, figures, folder, progress)
            lead = (
                f"A car follows a sine path at {settings.base.path.speed:g} m/s in wind, with noisy, unfiltered "
                f"measurements; after {settings.start:g} s come {settings.count} bad samples. Seed {seed}, "
                f"{'with' if gate else 'without'} the innovation gate."
            )
            page = write_page(folder / "report.html", "Faults", lead, fault_sections(content, figures), LAST_COLUMN)
        for name, outcomes in content["controllers"].items():
            print_table(faults_table(outcomes), label(name))
        print_sentences([f"Report: {page}"])


@study.command()
def discretization(
    cases: Annotated[str | None, typer.Option(help="Which systems, comma-separated; all if not given.")] = None,
    schemes: Annotated[str | None, typer.Option(help="Which schemes, comma-separated; all if not given.")] = None,
    backend: Annotated[
        str, typer.Option(help="auto, tailored, or portable, which needs no compiler and no time to compile.")
    ] = "auto",
    output: Annotated[Path, typer.Option(help="Folder for figures and report.")] = Path("out"),
) -> None:
    """Discretisation schemes: accuracy, cost and stability on the car and on stiff systems that are none."""
    with errors_in_words():
        from rumo.registry import DISCRETIZATIONS
        from rumo.report.page import write_page
        from rumo.studies.discretization import DiscretizationStudy
        from rumo.studies.discretization.cases import CASES
        from rumo.studies.discretization.charts import discretization_figures
        from rumo.studies.discretization.report import cheapest_table, discretization_sections, findings, summary

        settings = DiscretizationStudy(
            tuple(CASES if cases is None else words(cases)),
            tuple(DISCRETIZATIONS if schemes is None else words(schemes)),
            backend,
        )
        folder = writable(output)
        with progress_bars() as progress:
            results = settings.run(tasks(progress, settings.cases))
            content = summary(settings, results)
            figures = discretization_figures(content)
            write_study(content, figures, folder, progress)
            page = write_page(
                folder / "report.html",
                "Which discretisation?",
                f"Discretisation schemes in the real-time iteration ({backend} backend), on stiff systems.",
                discretization_sections(content, figures),
            )
        print_table(cheapest_table(content), "The cheapest step for an accuracy, as a share of the outputs' range")
        print_sentences(findings(content))
        print_sentences([f"Report: {page}"])


@study.command()
def linearization(
    controllers: Annotated[str, typer.Option(help="Which controllers drive, comma-separated.")] = "rti,nlp,ltv",
    sweeps: Annotated[str | None, typer.Option(help="What grows, comma-separated; all if not given.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of noise.")] = 0,
    output: Annotated[Path, typer.Option(help="Folder for figures and report.")] = Path("out"),
) -> None:
    """Linearised about the last plan, along the reference, or not at all: who loses the car, and what it costs."""
    with errors_in_words():
        from rumo.report.page import write_page
        from rumo.studies.linearization import SWEEPS, LinearizationStudy
        from rumo.studies.linearization.report import (
            findings,
            linearization_panels,
            linearization_sections,
            overview_table,
            summary,
        )

        names = list(SWEEPS) if sweeps is None else words(sweeps)
        known_names(names, "--sweeps", SWEEPS)
        values = {name: SWEEPS[name].values for name in names}
        settings = LinearizationStudy(tuple(words(controllers)), values, seed=seed)
        folder = writable(output)
        with progress_bars() as progress:
            logs = settings.run(tasks(progress, names))
            content = summary(settings, logs)
            figures = linearization_panels(content, logs)
            write_study(content, figures, folder, progress)
            page = write_page(
                folder / "report.html",
                "Where to linearise",
                f"A car on a sine path that gets harder to drive; {settings.duration:g} s a drive, seed {seed}.",
                linearization_sections(content, figures),
            )
        print_table(overview_table(content), "Who is lost where, and what the others cost")
        print_sentences(findings(content))
        print_sentences([f"Report: {page}"])
