"""A run of a campaign once more: its log, whether it is the same, and what it looked like."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from rumo.campaigns.comparison.drives import over_time
from rumo.campaigns.judging.columns import BY_KEY, KPI, MADE_WITH, RUN, STATUS, texts, title_of, unit_of
from rumo.campaigns.judging.criteria import Criterion
from rumo.campaigns.judging.summary import plain
from rumo.campaigns.report.drives import drive_figures
from rumo.campaigns.report.words import settings_words
from rumo.campaigns.specification import Campaign
from rumo.campaigns.store import read_head, read_rows
from rumo.campaigns.tasks.supervised import Supervised
from rumo.campaigns.work import WORK
from rumo.errors import ArgumentError
from rumo.report.contents import Beside, Item, Report, Section
from rumo.report.tables import Table, number
from rumo.scenarios.differences import differences
from rumo.simulation.log import load
from rumo.studies.looks import label

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class Rerun:
    """A run that was made again.

    Attributes
    ----------
    key, controller, draw, settings
        Which run.
    log : xarray.Dataset or None
        Of the run, as far as it went.
    error : str or None
        What it raised.
    row : dict
        What it came to: `outcome`, `ended`, and figures of merit, as in rows.
    before : dict
        The row of the campaign.
    criteria : tuple of Criterion
        By which the campaign judges.
    """

    key: str
    controller: str
    draw: int
    settings: Mapping[str, Any]
    log: xr.Dataset | None
    error: str | None
    row: Mapping[str, Any]
    before: Mapping[str, Any]
    criteria: tuple[Criterion, ...]

    @property
    def differs(self) -> list[str]:
        """Columns of which the value is not the same, bit for bit; those of times are not compared."""
        compared = [name for name in self.row if name.startswith((KPI, STATUS)) or name in ("outcome", "ended")]
        return [name for name in compared if plain(self.before.get(name)) != plain(self.row[name])]

    @property
    def environment(self) -> dict[str, tuple[Any, Any]]:
        """What the two were not made with alike, by name: versions, build of the core, machine; then, and now."""
        pairs = {name: tuple(plain(row.get(RUN + name)) for row in (self.before, self.row)) for name in MADE_WITH}
        return {name: (then, now) for name, (then, now) in pairs.items() if then != now and None not in (then, now)}

    @property
    def told(self) -> str:
        """Whether it came to the same, in words, and what may be why if it did not."""
        if not self.differs:
            return "It came to what its row says, bit for bit."
        words = f"Not what its row says: {', '.join(self.differs)} came to another value."
        made = [f"{name} was {then}, is {now}" for name, (then, now) in self.environment.items()]
        if made:
            return f"{words} It was not made with the same: {'; '.join(made)}."
        return f"{words} Versions, build of the core and machine are the same, as far as its row says."


def rerun(folder: str | Path, key: str) -> Rerun:
    """Make a run of a campaign, a tuning or a falsification again, in a process that may crash or hang as it did then.

    Parameters
    ----------
    folder : str or Path
        Of the campaign.
    key : str
        Of the run, or the beginning of it.

    Raises
    ------
    ArgumentError
        If there is no campaign, no such run or several, or if a file or a version that decides it is not what it was.
    """
    head = read_head(folder)
    specification = head["specification"]
    rows = read_rows(folder)
    before = _row(rows, key)
    campaign, further, identity = _campaign_of(specification, before)
    task = campaign.task(int(before["draw"]), str(before["controller"]), further)
    if task["key"] != before["key"]:
        words = differences(head.get("identity", {}), identity)
        raise ArgumentError(
            "key",
            f"{before['key']}, which is now the run {task['key']}{f': {words}' if words else ''}",
            "a run of which nothing has changed",
            f"It was made by Rumo {before.get('run.rumo')}; that version, and the files as they were, repeat it.",
        )
    logged: Any = {**task, "log": True}
    with Supervised(WORK, campaign.common) as process:
        row = process.run(logged)
    log, criteria = row.pop("log", None), tuple(campaign.criteria.values())
    decided = task["key"], task["controller"], task["draw"], task["settings"]
    return Rerun(*decided, None if log is None else _loaded(log), row["error"], row, before, criteria)


def _loaded(log: bytes) -> xr.Dataset:
    with TemporaryDirectory() as folder:
        place = Path(folder) / "log.nc"
        place.write_bytes(log)
        return load(place)


def _campaign_of(
    specification: Mapping[str, Any], before: Mapping[str, Any]
) -> tuple[Campaign, dict[str, Any], dict[str, Any]]:
    """The campaign that a row is of, what is set on top of it, as looked for: settings or a disturbance; identity."""
    if "tune" in specification:
        from rumo.campaigns.tuning.reading import tuning_of

        tuning = tuning_of(specification)
        return *tuning.drives_of(before), tuning.identity
    if "falsify" not in specification:
        campaign = Campaign.of(specification)
        return campaign, {}, campaign.identity
    from rumo.campaigns.falsification.reading import TABLES, falsification_of

    found = falsification_of({name: specification[name] for name in TABLES})
    return found.drives, found.chosen_in(before), found.identity


def _row(rows: Any, key: str) -> dict[str, Any]:
    keys = texts(rows, "key")
    found = [i for i, other in enumerate(keys) if key and other.startswith(key)]
    if len(found) != 1:
        got = f"{key!r}, of which there are {len(found)}" if found else repr(key)
        raise ArgumentError("key", got, f"the key of one of {len(keys)} runs, or the beginning of it")
    return rows.iloc[found[0]].to_dict()


def rerun_report(found: Rerun) -> Report:
    """Sentences, figures of merit and figures of a run that was made again."""
    same = not found.differs
    items: list[Item] = [found.told]
    items += [text for text in (found.error, found.row.get("ended")) if text]
    for criterion in found.criteria:
        why = criterion.why(found.row)
        items.append(f"{criterion.name}, {criterion.words}: {f'fails, {why}' if why else 'passes'}.")
    values = {name.removeprefix(KPI): plain(value) for name, value in found.row.items() if name.startswith(KPI)}
    rows = [
        [title_of(name), number(_whole(value)), unit_of(name), BY_KEY[name.partition(".")[0]].meaning]
        for name, value in values.items()
        if value is not None and name.partition(".")[0] in BY_KEY
    ]
    sections = [Section("How it went", items, brief=True)]
    if found.log is not None and found.log.sizes["time"] > 1:
        charts = drive_figures(found.log, found.key)
        shown: list[Item] = [Beside(charts)] if charts else []
        known = {figure.title for figure in charts}
        shown += [figure for figure in over_time({"Run": found.log}) if figure.title not in known]
        sections.append(Section("Over time", shown))
    if rows:
        sections.append(Section("Figures of merit", [Table(["", "Value", "Unit", "Meaning"], rows, words=(0, 2, 3))]))
    content = {
        "key": found.key,
        "controller": found.controller,
        "draw": found.draw,
        "settings": dict(found.settings),
        "same": same,
        "differs": found.differs,
        "environment": {name: {"then": then, "now": now} for name, (then, now) in found.environment.items()},
        "error": found.error,
        "ended": found.row.get("ended"),
        "kpis": values,
    }
    lead = f"{label(found.controller)}, draw {found.draw}: {settings_words(found.settings)}."
    warning = "" if same else found.told
    return Report(f"Run {found.key}", lead, content, sections, warning)


def _whole(value: Any) -> Any:
    """Numbers that are whole without a fraction, as counts are in tables of floats."""
    return int(value) if isinstance(value, float) and np.isfinite(value) and value == int(value) else value
