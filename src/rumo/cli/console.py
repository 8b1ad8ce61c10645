"""What the commands share: options, errors in words, folders, tables and sentences."""

from __future__ import annotations

import re
import tempfile
import textwrap
from collections.abc import Generator, Iterable, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, TextIO, TypeVar, cast

import typer
from rich.console import Console
from rich.text import Text

from rumo.cli.streams import Unheeded
from rumo.errors import ArgumentError, RumoError
from rumo.report.contents import Command, Report
from rumo.report.folder import as_json
from rumo.report.tables import Table

Json = Annotated[bool, typer.Option("--json", help="Print the results as JSON, and nothing else.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")]

N = TypeVar("N", int, float)

GAP = 2
"""Between columns of a table."""


def words(text: str | None) -> list[str]:
    """What a comma-separated option names, each once."""
    return list(dict.fromkeys(word.strip() for word in text.split(","))) if text else []


def numbers(text: str, option: str, kind: type[N]) -> tuple[N, ...]:
    """Numbers that a comma-separated option lists, whole ones also from-to, each once."""
    found: list[N] = []
    for word in words(text):
        first, dash, last = word.partition("-")
        try:
            if kind is int and dash and first:
                found += [kind(number) for number in range(int(first), int(last) + 1)]
            else:
                found.append(kind(word))
        except ValueError:
            example = "8 or 8,11" if kind is float else "5, 1,5,25 or 0-9"
            raise ArgumentError(option, repr(word), f"numbers such as {example}") from None
    return tuple(dict.fromkeys(found))


@contextmanager
def errors_in_words() -> Generator[None]:
    """An error of ours is one sentence on standard error and exit code 2."""
    try:
        yield
    except RumoError as error:
        print_error(str(error))
        raise typer.Exit(2) from None


def standard_error() -> Console:
    """For what is told beside the results; it is forgotten where it cannot be written."""
    return Console(file=cast("TextIO", Unheeded()))


def print_error(text: str) -> None:
    """One line on standard error."""
    standard_error().print(f"Error: {text}", style="bold red", soft_wrap=True, highlight=False, markup=False)


def print_note(text: str) -> None:
    """One line on standard error that is no error."""
    standard_error().print(text, soft_wrap=True, highlight=False, markup=False)


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


def print_json(content: Mapping[str, Any]) -> None:
    """For machines, on standard output."""
    typer.echo(as_json(content))


def print_lines(lines: Iterable[str]) -> None:
    """A line for each sentence, however long, on the terminal."""
    for line in lines:
        Console().print(line, soft_wrap=True, highlight=False, markup=False)


def print_report(report: Report) -> None:
    """Sentences, commands and tables of a report's brief sections."""
    if report.warning:
        print_lines([report.warning])
    for section in report.sections:
        if section.brief:
            for item in section.content:
                if isinstance(item, Table):
                    print_table(item, section.heading)
                elif isinstance(item, str):
                    print_lines([item])
                elif isinstance(item, Command):
                    print_lines([f"    {item.text}"])


def print_table(table: Table, title: str, console: Console | None = None) -> None:
    """A table on the terminal, as narrow as it must be, without splitting words."""
    console = console or Console()
    columns = [[head, *(row[i] for row in table.rows)] for i, head in enumerate(table.heads)]
    widths = _widths(columns, console.width - GAP * (len(columns) - 1))
    wrapped = [[_wrapped(text, width) for text in column] for column, width in zip(columns, widths, strict=True)]
    console.print(Text(f"\n{title}", style="bold"))
    for i, cells in enumerate(zip(*wrapped, strict=True)):
        height = max(map(len, cells))
        for line in range(height):
            # Heads stand on the rule below them, rows hang from the line above.
            shown = [line - height + len(cell) if i == 0 else line for cell in cells]
            texts = [cell[k] if 0 <= k < len(cell) else "" for cell, k in zip(cells, shown, strict=True)]
            aligned = [
                text.ljust(width) if k in table.words else text.rjust(width)
                for k, (text, width) in enumerate(zip(texts, widths, strict=True))
            ]
            console.print(Text((" " * GAP).join(aligned).rstrip()), soft_wrap=True)
        if i == 0:
            console.print(Text("\u2500" * (sum(widths) + GAP * (len(widths) - 1))), soft_wrap=True)


def _widths(columns: list[list[str]], room: int) -> list[int]:
    """Of columns: the widest give way first, none by more than its longest word."""
    widths = [max(len(line) for text in column for line in text.split("\n")) for column in columns]
    least = [max((len(word) for text in column for word in re.split("[ \n]", text)), default=0) for column in columns]
    while sum(widths) > room and widths != least:
        i = max((i for i in range(len(widths)) if widths[i] > least[i]), key=widths.__getitem__)
        widths[i] -= 1
    return widths


def _wrapped(text: str, width: int) -> list[str]:
    """Lines of a cell, broken at spaces that may be broken at."""
    lines = [
        textwrap.wrap(line, max(width, 1), break_long_words=False, break_on_hyphens=False) for line in text.split("\n")
    ]
    return [part.replace("\u00a0", " ") for parts in lines for part in parts or [""]]
