"""`rumo study ...`: from options to settings."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from rumo.checks import known_names
from rumo.cli.console import Json, Quiet, errors_in_words, numbers, words
from rumo.cli.sequence import run_study
from rumo.errors import ArgumentError

study = typer.Typer(help="Run a study and write its report.", no_args_is_help=True)

Controllers = Annotated[str, typer.Option(help="Which controllers drive, comma-separated.")]
Jobs = Annotated[int, typer.Option(min=1, help="Processes that drive at the same time.")]
Resume = Annotated[bool, typer.Option("--resume", help="Go on with what an interrupted study has left in the folder.")]
Seeds = Annotated[str, typer.Option(help="Seeds of wind and noise, comma-separated, or from-to: 0-9.")]
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
    faults: Annotated[str | None, typer.Option(help="Which faults, comma-separated; all if not given.")] = None,
    speeds: Annotated[str, typer.Option(help="Speeds, comma-separated [m/s].")] = "8",
    samples: Annotated[str, typer.Option(help="Numbers of bad samples, comma-separated.")] = "5",
    seeds: Seeds = "0",
    start: Annotated[float, typer.Option(help="When the first bad sample is [s].")] = 3.0,
    gate: Annotated[bool, typer.Option(help="Hold back implausible measurements.")] = True,
    logs: Annotated[bool, typer.Option("--logs", help="Keep the log of every drive.")] = False,
    jobs: Jobs = 1,
    resume: Resume = False,
    output: Output = Path("out"),
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Drives through bad samples. Sensors, actuators, solvers and roads fail for a while, and the car goes on."""
    with errors_in_words():
        from rumo.studies.faults import FAULTS, FaultStudy

        names = list(FAULTS) if faults is None else words(faults)
        known_names(names, "--faults", FAULTS)
        settings = FaultStudy(
            tuple(words(controllers)),
            tuple(names),
            numbers(speeds, "--speeds", float),
            numbers(samples, "--samples", int),
            numbers(seeds, "--seeds", int),
            start=start,
            keep_logs=logs,
        )
        settings = settings if gate else replace(settings, gate=None)
        run_study(settings, output, as_json=as_json, quiet=quiet, jobs=jobs, resume=resume)


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
    controllers: Controllers = "rti,plain,nlp,ltv",
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


@study.command()
def roads(
    cases: Annotated[str | None, typer.Option(help="Which cases, comma-separated; all if not given.")] = None,
    controllers: Annotated[
        str | None, typer.Option(help="Which controllers drive, comma-separated; those of each case if not given.")
    ] = None,
    seeds: Seeds = "0-4",
    tracks: Annotated[
        str, typer.Option(help="Names or files of tracks, comma-separated; of a folder, all CSV files.")
    ] = "oval,club,eight",
    nlp_distance: Annotated[
        float | None, typer.Option(help="How far the NLP drives on tracks [m]; whole laps if not given.")
    ] = None,
    logs: Annotated[bool, typer.Option("--logs", help="Keep the log of every drive.")] = False,
    jobs: Jobs = 1,
    resume: Resume = False,
    output: Output = Path("out"),
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """A car on the road. Sine, tracks, moose test, ice, a racer: figures, and the goals that they have."""
    with errors_in_words():
        from rumo.studies.roads import CASES, RoadStudy

        settings = RoadStudy(
            tuple(CASES if cases is None else words(cases)),
            None if controllers is None else tuple(words(controllers)),
            numbers(seeds, "--seeds", int),
            track_files(words(tracks)),
            nlp_distance,
            logs,
        )
        run_study(settings, output, as_json=as_json, quiet=quiet, jobs=jobs, resume=resume)


def track_files(given: list[str]) -> tuple[str, ...]:
    """Tracks as they were named, folders by the CSV files in them."""
    found: list[str] = []
    for name in given:
        inside = sorted(str(file) for file in Path(name).glob("*.csv")) if Path(name).is_dir() else [name]
        if not inside:
            raise ArgumentError(
                "--tracks", f"{name!r}, a folder without CSV files", "files, folders with some, or names"
            )
        found += inside
    return tuple(found)


@study.command()
def estimation(
    questions: Annotated[str | None, typer.Option(help="Which questions, comma-separated; all if not given.")] = None,
    estimators: Annotated[str | None, typer.Option(help="Which estimators, comma-separated; all if not given.")] = None,
    seeds: Seeds = "0-4",
    duration: Annotated[float, typer.Option(help="Length of a drive [s].")] = 30.0,
    window: Annotated[int, typer.Option(help="Samples that a moving horizon looks back on.")] = 10,
    track: Annotated[str, typer.Option(help="A track by name, or a file.")] = "club",
    jobs: Jobs = 1,
    resume: Resume = False,
    output: Output = Path("out"),
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Kalman filter or moving horizon. Plain noise, outliers, bounds, wrong starts and late measurements on a track."""
    with errors_in_words():
        from rumo.studies.estimation import CONTENDERS, QUESTIONS, EstimationStudy
        from rumo.studies.estimation.study import ROAD

        asked = list(QUESTIONS) if questions is None else words(questions)
        known_names(asked, "--questions", QUESTIONS)
        names = list(CONTENDERS) if estimators is None else words(estimators)
        known_names(names, "--estimators", CONTENDERS)
        settings = EstimationStudy(
            tuple(asked),
            tuple(names),
            numbers(seeds, "--seeds", int),
            duration,
            window,
            replace(ROAD, track=track),
        )
        run_study(settings, output, as_json=as_json, quiet=quiet, jobs=jobs, resume=resume)


@study.command()
def race_line(
    tracks: Annotated[
        str | None,
        typer.Option(help="Which tracks, by name or file, comma-separated; those shipped if not given."),
    ] = None,
    vehicle: Annotated[str, typer.Option(help="A vehicle by name, or a TOML file.")] = "passenger",
    grip: Annotated[float, typer.Option(help="Share of friction that is used.")] = 0.9,
    margin: Annotated[
        float | None,
        typer.Option(help="From line to edges [m]; half the car's width and 0.3 m if not given."),
    ] = None,
    spacing: Annotated[float, typer.Option(help="Of the nodes of the nonlinear program [m].")] = 1.0,
    drive: Annotated[bool, typer.Option("--drive", help="Drive a lap of each line.")] = False,
    width: Annotated[float | None, typer.Option(help="Of tracks from files that have none [m].")] = None,
    smoothing: Annotated[float | None, typer.Option(help="Of centre lines from files [m].")] = None,
    output: Output = Path("out"),
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Which line is fast. Least time beside least curvature and the centre line, timed, and driven if wanted."""
    with errors_in_words():
        from rumo.references import TRACKS
        from rumo.studies.race_line import RaceLineStudy

        names = tuple(TRACKS if tracks is None else words(tracks))
        settings = RaceLineStudy(names, vehicle, grip, margin, spacing, drive, width, smoothing)
        run_study(settings, output, as_json=as_json, quiet=quiet)
