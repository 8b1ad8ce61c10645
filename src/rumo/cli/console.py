"""What the commands share: errors in words, folders, progress, tables, and the files of a study."""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table as RichTable
from rich.text import Text

from rumo.errors import ArgumentError, RumoError
from rumo.report.tables import Table

if TYPE_CHECKING:
    from rumo.report.charts import Chart, Panels


def words(text: str | None) -> list[str]:
    """What a comma-separated option names, each once."""
    return list(dict.fromkeys(word.strip() for word in text.split(","))) if text else []


@contextmanager
def errors_in_words() -> Generator[None]:
    """An error of ours is one sentence on standard error and exit code 2."""
    try:
        yield
    except RumoError as error:
        Console(stderr=True).print(f"Error: {error}", style="bold red", soft_wrap=True, highlight=False, markup=False)
        raise typer.Exit(2) from None


def writable(folder: Path) -> Path:
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


def write_study(
    content: Mapping[str, Any], figures: Sequence[Chart | Panels], folder: Path, progress: Progress
) -> None:
    """A study's summary and figures."""
    from rumo.report.figures import write_figures

    write_json(content, folder / "summary.json")
    task = progress.add_task("figures", total=len(figures))
    for figure in figures:
        write_figures([figure], folder)
        progress.advance(task)


def write_json(content: Mapping[str, Any], path: Path) -> None:
    """For machines."""
    path.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def progress_bars() -> Progress:
    """On standard error, where a person watches."""
    return Progress(
        TextColumn("{task.description:>8}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=Console(stderr=True),
        disable=not sys.stderr.isatty(),
    )


def tasks(progress: Progress, names: Iterable[str]) -> Callable[[str, int, int], None]:
    """A bar for each name; what is returned tells them (name, done, all)."""
    bars = {name: progress.add_task(name, total=None) for name in names}
    return lambda name, done, every: progress.update(bars[name], completed=done, total=every)


def print_sentences(sentences: Iterable[str]) -> None:
    """A line for each, however long, on the terminal."""
    for sentence in sentences:
        Console().print(sentence, soft_wrap=True, highlight=False)


def print_table(table: Table, title: str) -> None:
    """A table on the terminal."""
    rich_table = RichTable(title=title, title_justify="left")
    for i, head in enumerate(table.heads):
        rich_table.add_column(Text(head), justify="right" if i else "left", overflow="fold")
    for row in table.rows:
        rich_table.add_row(*map(Text, row))
    Console().print(rich_table)
