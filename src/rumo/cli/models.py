"""`rumo models`."""

from __future__ import annotations

from typing import Annotated

import typer

from rumo.cli.console import Json, print_json, print_lines

Names = Annotated[bool, typer.Option("--quiet", "-q", help="Print names only.")]


def models(as_json: Json = False, quiet: Names = False) -> None:
    """List the models that come with Rumo. With their signals and units."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from rumo.registry import MODELS

    if as_json:
        made = {name: make() for name, make in MODELS.items()}
        content = {
            name: {signals.role: {key: signals.unit(key) for key in signals} for signals in model.signals}
            for name, model in made.items()
        }
        print_json(content)
    elif quiet:
        print_lines(MODELS)
    else:
        for name, make in MODELS.items():
            grid = Table(box=None, show_header=False, pad_edge=False, title=name, title_justify="left")
            for signals in make().signals:
                if len(signals):
                    row = (f"  {signals.role}", ", ".join(f"{key} [{signals.unit(key)}]" for key in signals))
                    grid.add_row(*map(Text, row))
            Console().print(grid, "")
