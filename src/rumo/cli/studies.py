"""`rumo study ...`: from options to settings."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from rumo.checks import known_names
from rumo.cli.console import Json, Quiet, errors_in_words, words
from rumo.cli.sequence import run_study

study = typer.Typer(help="Run a study and write its report.", no_args_is_help=True)

Controllers = Annotated[str, typer.Option(help="Which controllers drive, comma-separated.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of wind and noise.")]
Output = Annotated[
    Path, typer.Option(help="Folder for logs, figures and report; those of an earlier study are deleted.")
]


@study.command()
def paper(
    controllers: Controllers = "rti,nlp,ltv",
    seed: Seed = 0,
    duration: Annotated[float, typer.Option(help="Length of the drive [s].")] = 24.0,
    output: Output = Path("out"),
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """The paper's case study. A car follows a sine path in wind, with noisy sensors."""
    with errors_in_words():
        from rumo.studies import PaperStudy

        settings = PaperStudy(tuple(words(controllers)), seed, duration)
        run_study(settings, output, as_json=as_json, quiet=quiet)


@study.command()
def faults(
    controllers: Controllers = "rti,nlp",
    seed: Seed = 0,
    gate: Annotated[bool, typer.Option(help="Hold back implausible measurements.")] = True,
    output: Output = Path("out"),
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Drives through five bad samples in a row. Sensors and solvers fail, and the car goes on."""
    with errors_in_words():
        from rumo.studies.faults import FaultStudy

        settings = FaultStudy(tuple(words(controllers)), seed=seed)
        run_study(settings if gate else replace(settings, gate=None), output, as_json=as_json, quiet=quiet)


@study.command()
def discretization(
    cases: Annotated[str | None, typer.Option(help="Which systems, comma-separated; all if not given.")] = None,
    schemes: Annotated[str | None, typer.Option(help="Which schemes, comma-separated; all if not given.")] = None,
    backend: Annotated[
        str, typer.Option(help="auto, tailored, or portable, which needs no compiler and no time to compile.")
    ] = "auto",
    output: Output = Path("out"),
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Accuracy, cost and stability of discretisation schemes. On the car, and on stiff systems that are none."""
    with errors_in_words():
        from rumo.registry import DISCRETIZATIONS
        from rumo.studies.discretization import CASES, DiscretizationStudy

        settings = DiscretizationStudy(
            tuple(CASES if cases is None else words(cases)),
            tuple(DISCRETIZATIONS if schemes is None else words(schemes)),
            backend,
        )
        run_study(settings, output, as_json=as_json, quiet=quiet)


@study.command()
def linearization(
    controllers: Controllers = "rti,nlp,ltv",
    sweeps: Annotated[str | None, typer.Option(help="What grows, comma-separated; all if not given.")] = None,
    seed: Seed = 0,
    output: Output = Path("out"),
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Where to linearise. About the last plan, along the reference, or not at all: who loses the car, at what cost."""
    with errors_in_words():
        from rumo.studies.linearization import SWEEPS, LinearizationStudy

        names = list(SWEEPS) if sweeps is None else words(sweeps)
        known_names(names, "--sweeps", SWEEPS)
        settings = LinearizationStudy(
            tuple(words(controllers)), {name: SWEEPS[name].values for name in names}, seed=seed
        )
        run_study(settings, output, as_json=as_json, quiet=quiet)
