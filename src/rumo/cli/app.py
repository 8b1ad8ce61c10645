"""The application: its commands, `--version`, and what becomes of an output that nobody takes."""

from __future__ import annotations

import os
import sys
from typing import Annotated

import typer

import rumo
from rumo.cli.bench import bench
from rumo.cli.models import models
from rumo.cli.studies import study

app = typer.Typer(
    help=rumo.__doc__,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command()(bench)
app.add_typer(study, name="study")
app.command()(models)


@app.callback(invoke_without_command=True)
def options(
    version: Annotated[bool, typer.Option("--version", help="Print the version and exit.", is_eager=True)] = False,
) -> None:
    """Nonlinear model predictive control of stiff systems, road vehicles first."""
    if version:
        typer.echo(f"rumo {rumo.__version__}")
        raise typer.Exit


def main() -> None:
    """Run the command; a full disk is one line on standard error, and a reader that has gone away is silence."""
    code: int | str | None = 0
    try:
        try:
            app(prog_name="rumo")
        except SystemExit as end:
            code = end.code
        sys.stdout.flush()
    except BrokenPipeError:
        code = _give_up_output()
    except OSError as error:
        code = _give_up_output()
        print(f"Error: the output cannot be written: {error}", file=sys.stderr)
    except KeyboardInterrupt:
        code = 130
    sys.exit(code)


def _give_up_output() -> int:
    """So that Python does not try, and complain, once more at its end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 1
