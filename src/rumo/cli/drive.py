"""`rumo drive`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rumo.cli.console import Json, Quiet, errors_in_words
from rumo.cli.sequence import run_study


def drive(
    track: Annotated[
        str, typer.Option(help="oval, club, eight, iso-3888-1, iso-3888-2, or a file: CSV, GPX, CommonRoad.")
    ] = "club",
    vehicle: Annotated[
        str | None, typer.Option(help="passenger, paper, racer, commonroad-1, commonroad-3, or a TOML file.")
    ] = None,
    plant: Annotated[
        str, typer.Option(help="four-wheel, bicycle, or commonroad-ks, -st, -std, -mb; with a car: commonroad-mb:2.")
    ] = "four-wheel",
    controller: Annotated[str, typer.Option(help="rti, nlp or ltv.")] = "rti",
    grip: Annotated[float, typer.Option(help="Share of friction that the speed profile uses.")] = 0.9,
    laps: Annotated[int, typer.Option(help="To be driven.")] = 1,
    estimator: Annotated[
        str, typer.Option(help="ekf, mhe or butterworth with noisy sensors; none where the state is known.")
    ] = "ekf",
    mu: Annotated[float | None, typer.Option(help="Friction of the road; the car's if not given.")] = None,
    seed: Annotated[int, typer.Option(help="Seed of wind and noise.")] = 0,
    width: Annotated[float | None, typer.Option(help="Of the track, where its file has none [m].")] = None,
    smoothing: Annotated[
        float | None, typer.Option(help="How far the path may pass a file's points [m]; GPX needs 0.3 to 1.")
    ] = None,
    output: Annotated[
        Path, typer.Option(help="Folder for log, figures and report; those of an earlier drive are deleted.")
    ] = Path("out"),
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Drive a car around a track. Yours from files, at the limit of its grip, in wind and with noisy sensors."""
    with errors_in_words():
        from rumo.studies.drive import Drive

        settings = Drive(
            track, vehicle, plant, controller, grip, laps, estimator, mu, seed, width=width, smoothing=smoothing
        )
        run_study(settings, output, as_json=as_json, quiet=quiet)
