"""The application: its commands, and `--version`."""

from __future__ import annotations

from typing import Annotated

import typer

import rumo
from rumo.cli.bench import bench
from rumo.cli.campaign import campaign
from rumo.cli.compare import compare, rerun
from rumo.cli.drive import drive
from rumo.cli.falsify import falsify
from rumo.cli.models import models
from rumo.cli.studies import study
from rumo.cli.tune import tune

app = typer.Typer(
    help=rumo.__doc__,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command()(drive)
app.command()(bench)
app.add_typer(study, name="study")
app.command()(campaign)
app.command()(compare)
app.command()(rerun)
app.command()(tune)
app.command()(falsify)
app.command()(models)


@app.callback(invoke_without_command=True)
def options(
    version: Annotated[bool, typer.Option("--version", help="Print the version and exit.", is_eager=True)] = False,
) -> None:
    """Nonlinear model predictive control of stiff systems, road vehicles first."""
    if version:
        typer.echo(f"rumo {rumo.__version__}")
        raise typer.Exit
