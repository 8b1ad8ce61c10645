"""The report of a falsification."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rumo.campaigns.falsification.charts import drives_section, search_section, violate
from rumo.campaigns.falsification.falsify import FOUND, Falsified
from rumo.campaigns.falsification.summary import summary
from rumo.campaigns.judging.criteria import Criterion
from rumo.campaigns.report.failures import LONGEST, WORDS, flattened
from rumo.campaigns.report.words import capital, rerun_command, settings_words, value_words
from rumo.report.contents import Command, Item, Report, Section
from rumo.report.folder import incomplete
from rumo.report.tables import Table, number
from rumo.studies.looks import label


def report(falsified: Falsified) -> Report:
    """Sentences, tables and figures of what came of a falsification, and its summary.

    Parameters
    ----------
    falsified : Falsified
        What came of it.
    """
    content = summary(falsified, falsified.folder.resolve().name)
    found = [
        headline(content, falsified),
        drives_section(falsified),
        search_section(content, falsified),
        _failures(content),
        _asked(content),
    ]
    chosen = ", ".join(content["settings"])
    lead = (
        f"{number(content['trials']['done'])} disturbances, driven by {label(content['controller'])}; chosen: {chosen}."
    )
    title = f"Falsification {content['falsification']}"
    page = Report(title, lead, content, [section for section in found if section is not None])
    if falsified.stopped is None:
        return page
    done = f"{len(falsified.trials)} of {falsified.falsification.trials} trials are done, and started again it goes on"
    return incomplete(page, done, falsified.stopped)


def headline(content: Mapping[str, Any], falsified: Falsified) -> Section:
    """What was found, what it violates, and what holds."""
    criteria = falsified.falsification.criteria
    without = "; ".join(f"{criteria[name].words}: {number(each['value'])}" for name, each in content["without"].items())
    if content["found"] is None:
        return Section(
            "What was found", [*_nothing(content, criteria), f"Without a disturbance: {without}."], brief=True
        )
    found = content["found"]
    items: list[Item] = [*_sentences(content, criteria), f"Without a disturbance: {without}."]
    items.append(_table(content))
    items += [
        "Its drive again, with a report, bit for bit:",
        Command(rerun_command(str(falsified.folder), found["key"])),
    ]
    items.append(f"Its scenario, for rumo.scenarios.Recipe.from_toml and campaigns, is in {falsified.folder / FOUND}.")
    return Section("What was found", items, brief=True)


def _sentences(content: Mapping[str, Any], criteria: Mapping[str, Criterion]) -> list[str]:
    found, trials, largest = content["found"], content["trials"], content["largest_size"]
    if found["size"] == 0.0:
        told = ["With these settings something is violated without any disturbance."]
    else:
        told = [
            f"The smallest disturbance that was found has size {found['size']:.4g}, of {largest:.3g} at most: "
            f"{settings_words(found['settings'])}."
        ]
    told += [
        f"It violates {name}, {criteria[name].words}: {found['criteria'][name]['why']}." for name in found["violated"]
    ]
    if found["error"]:
        told.append(f"Its drive raised: {found['error'].strip().splitlines()[0]}.")
    if found["holds_at"] is not None:
        held = ", ".join(value_words(each["value"]) for each in found["held"].values())
        told.append(f"At size {found['holds_at']:.4g}, all else the same, everything holds: {held}.")
    smaller = found["smaller_that_hold"]
    told.append(
        f"{number(trials['violating'])} of {number(trials['done'])} trials {violate(trials['violating'])} something. "
        f"{number(smaller)} of those that hold {'is' if smaller == 1 else 'are'} smaller than what was found; that "
        "none below it violates anything is not proved."
    )
    return told


def _nothing(content: Mapping[str, Any], criteria: Mapping[str, Criterion]) -> list[str]:
    done, nearest = number(content["trials"]["done"]), content["nearest"]
    told = [f"None of {done} disturbances violates anything; that none does is not proved."]
    if not content["complete"]:
        violating = content["trials"]["violating"]
        told = [f"{number(violating)} of {done} disturbances {violate(violating)} something, so far."]
    if nearest is not None:
        values = "; ".join(f"{criteria[name].words}: {number(value)}" for name, value in nearest["values"].items())
        told.append(f"The nearest to a limit has size {nearest['size']:.4g}, {settings_words(nearest['settings'])}.")
        told.append(f"{capital(values)}.")
    return told


def _table(content: Mapping[str, Any]) -> Table:
    """A row for each setting that was chosen."""
    rows: list[list[str]] = []
    for name, of in content["settings"].items():
        choice, nothing = of["choice"], of["nothing"]
        if isinstance(choice, Mapping) and "low" in choice:
            span = f"{value_words(choice['low'])} to {value_words(choice['high'])}"
        else:
            span = value_words(choice)[:LONGEST]
        value = value_words(content["found"]["settings"][name])
        rows.append([name, "-" if nothing is None else value_words(nothing), value, span])
    return Table(["Setting", "Without\na disturbance", "Found", "Could be"], rows, words=(0, 3))


def _failures(content: Mapping[str, Any]) -> Section | None:
    if not content["failures"]:
        return None
    rows = [
        [WORDS.get(each["outcome"], ""), (each["error"] or "")[:LONGEST], each["key"]] for each in content["failures"]
    ]
    return Section("What went wrong", [Table(["The drive", "Such as", "Key"], rows, words=(0, 1, 2))])


def _asked(content: Mapping[str, Any]) -> Section:
    rows = [[name, value_words(value)[:LONGEST]] for name, value in flattened(content["specification"]).items()]
    return Section("What was asked", [Table(["Setting", "Value"], rows, words=(0, 1))])
