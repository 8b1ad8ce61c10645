"""The application: its commands, `--version` and `models`."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table as RichTable
from rich.text import Text

import rumo
from rumo.cli.bench import bench
from rumo.cli.studies import study

app = typer.Typer(
    help=rumo.__doc__, no_args_is_help=True, add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False
)
app.command()(bench)
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
