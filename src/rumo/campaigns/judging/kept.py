"""What a campaign's folder keeps, to be reported again, compared, and rerun."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rumo.campaigns.judging.criteria import Criterion
from rumo.campaigns.judging.results import Results
from rumo.campaigns.store import read_head, read_rows
from rumo.errors import ArgumentError


def read_results(folder: str | Path) -> Results:
    """What came of the campaign in a folder, finished or not.

    Raises
    ------
    ArgumentError
        If there is no campaign, or none of its runs is done yet.
    FileError
        If the folder has files that no campaign writes, or torn ones.
    """
    folder = Path(folder)
    specification: Mapping[str, Any] = read_head(folder)["specification"]
    rows = read_rows(folder)
    if not len(rows):
        raise ArgumentError("campaign", f"'{folder}', of which no run is done yet", "one with rows", "Start it again.")
    settings = specification.get("campaign", {})
    controllers = tuple(settings.get("controllers", ()))
    runs = settings.get("runs")
    if runs is not None:
        rows = rows.loc[rows["draw"] < runs].reset_index(drop=True)  # there may have been more before
    chosen = specification.get("report", {}).get("heat_map")
    return Results(
        rows,
        tuple(Criterion.of(name, table) for name, table in specification.get("criteria", {}).items()),
        controllers,
        heat_map=(chosen[0], chosen[1]) if chosen else None,
        name=folder.resolve().name,
        folder=folder,
        specification=specification,
        asked=None if runs is None else runs * max(len(controllers), 1),
    )
