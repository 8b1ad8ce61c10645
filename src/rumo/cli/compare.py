"""`rumo compare` and `rumo rerun`: what campaigns and drives have left, looked at again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from rumo.cli.console import Json, Quiet, errors_in_words, writable
from rumo.cli.sequence import write_report
from rumo.errors import ArgumentError

HEAD = "campaign.json"


def compare(
    first: Annotated[Path, typer.Argument(help="Folder of a campaign, or a log (.nc) of a drive.")],
    second: Annotated[Path, typer.Argument(help="Another one.")],
    output: Annotated[Path, typer.Option(help="Folder for the report.")] = Path("comparison"),
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Compare two campaigns or two drives. Draws of the same settings and seeds are paired."""
    with errors_in_words():
        from rumo.campaigns.comparison import compare_campaigns, compare_drives

        logs = [_is_log(path) for path in (first, second)]
        names = _names(first, second)
        _apart(output)
        if all(logs):
            found = compare_drives(_log(first), _log(second), names)
        elif any(logs):
            log, other = (first, second) if logs[0] else (second, first)
            raise ArgumentError("second", f"a log, '{log}', beside '{other}'", "two campaigns, or two logs")
        else:
            from rumo.campaigns.judging.kept import read_results

            found = compare_campaigns(read_results(first), read_results(second), names)
        write_report(found, writable(output), as_json=as_json, quiet=quiet)


def rerun(
    folder: Annotated[Path, typer.Argument(help="Of a campaign, a tuning or a falsification.")],
    key: Annotated[str, typer.Argument(help="Of the run, as its row and the report say, or the beginning of it.")],
    output: Annotated[
        Path | None, typer.Option(help="Folder for log and report; rerun-KEY in the campaign's folder if not given.")
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Make a run of a campaign again, bit for bit. Its log is kept, with a report."""
    with errors_in_words():
        from rumo.campaigns.rerun import rerun as again
        from rumo.campaigns.rerun import rerun_report
        from rumo.simulation.log import save

        if output is not None:
            _apart(output)
        found = again(folder, key)
        place = writable(folder / f"rerun-{found.key}" if output is None else output)
        if found.log is not None:
            save(found.log, place / f"{found.key}.nc")
        write_report(rerun_report(found), place, as_json=as_json, quiet=quiet)


def _is_log(path: Path) -> bool:
    if not path.exists():
        raise ArgumentError("campaign", f"'{path}', which is not there", "the folder of a campaign, or a log")
    return path.is_file()


def _log(path: Path) -> Any:
    from rumo.simulation.log import load

    return load(path)


def _names(first: Path, second: Path) -> tuple[str, str]:
    """What the two are called: as short as tells them apart."""
    one, other = first.resolve(), second.resolve()
    for parts in range(1, 4):
        names = ["/".join(path.parts[-parts:]) for path in (one, other)]
        if names[0] != names[1]:
            return names[0], names[1]
    return "first", "second"


def _apart(output: Path) -> None:
    """A campaign has a report of its own."""
    if (output / HEAD).exists():
        raise ArgumentError("--output", f"'{output}', which is a campaign's", "another folder")
