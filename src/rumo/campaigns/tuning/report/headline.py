"""What comes first: what was gained, and whether the limits hold, on drives that the tuning knew nothing of."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rumo.campaigns.judging.columns import inside, title_of, unit_of
from rumo.campaigns.report.pairs import signed
from rumo.campaigns.report.words import capital, ends, percent, value_words
from rumo.report.contents import Item, Section
from rumo.report.tables import Table, number

OF = {"mean": "mean", "median": "median", "p95": "95 % of drives below", "max": "largest", "min": "least"}


def headline(content: Mapping[str, Any]) -> Section:
    """Objectives and limits, before and after."""
    if not content["best"]:
        return Section("What was gained", [_nothing(content["trials"])], brief=True)
    if _as_before(content):
        told = f"None of the {number(content['trials']['done'])} trials is better than the settings as they were."
        return Section(
            "What was gained",
            [told, "More trials, or other limits, may come to some that are.", values_table(content)],
            brief=True,
        )
    items: list[Item] = [_sentence(name, each) for name, each in content["objectives"].items()]
    items += _limits(content)
    items.append(values_table(content))
    if all(each["check"] is None for each in content["objectives"].values()):
        items.append(
            "These are the drives that the settings were chosen by, so others will be somewhat worse: a table [check] "
            "says which others judge them."
        )
    return Section("What was gained", items, brief=True)


def _as_before(content: Mapping[str, Any]) -> bool:
    """Whether the settings that were tuned are the best themselves."""
    return len(content["best"]) == 1 and all(each["before"] == each["after"] for each in content["settings"].values())


def _nothing(trials: Mapping[str, Any]) -> str:
    if not trials["done"]:
        return "No trial is done."
    return (
        f"None of the {number(trials['done'])} trials is within the limits ({number(trials['failed'])} failed): "
        "there are no better settings. Widen the limits or what may be chosen, or drive more trials."
    )


def _sentence(name: str, each: Mapping[str, Any]) -> str:
    """Of an objective: its change on held-out drives, or else on those of the trials."""
    found, unit = each["check"] or each["tuning"], f" {unit_of(each['kpi'])}" if unit_of(each["kpi"]) else ""
    which = "drives that it did not know" if each["check"] else "drives of the trials"
    words = f"{capital(name)}: {OF[each['of']]} {inside(title_of(each['kpi']))}"
    change = f"{number(found['before'])}{unit} before, {number(found['after'])}{unit} after{_ratio(found['ratio'])}"
    drives = f"{number(found['drives'])} {which}"
    paired = ""
    if each["check"] and found["difference"] is not None:
        better = found["more"] if each["maximise"] else found["less"]
        interval = f", 95 % interval {ends(found['interval'])}{unit}" if found["interval"] else ""
        paired = (
            f" Drive by drive, the difference is {signed(found['difference'])}{unit} on average{interval}; "
            f"{percent(better)} % of them are better."
        )
    return f"{words} over {drives}: {change}.{paired}"


def _ratio(ratio: float | None) -> str:
    return "" if ratio is None else f", {ratio:.3g} times as much"


def _limits(content: Mapping[str, Any]) -> list[Item]:
    """Whether all limits hold on the drives of the check."""
    found = {name: each["check"] or each["tuning"] for name, each in content["limits"].items()}
    if not found:
        return []
    broken = [name for name, each in found.items() if not each["held_after"]]
    where = "the drives that it did not know" if content["limits"][next(iter(found))]["check"] else "its own drives"
    if not broken:
        return [f"{'All limits hold' if len(found) > 1 else 'The limit holds'} on {where}."]
    return [
        f"Not within its limit on {where}: {', '.join(broken)}. Ask for less in the trials, or for more drives each."
    ]


def values_table(content: Mapping[str, Any]) -> Table:
    """A row for each objective and limit, over the drives of the trials and over those of the check."""
    rows: list[list[str]] = []
    for kind in ("objectives", "limits"):
        for name, each in content[kind].items():
            for where, words in (("tuning", "trials"), ("check", "check")):
                found = each[where]
                if found is None:
                    continue
                ratio = "-" if found["ratio"] is None else f"{found['ratio']:.3f}"
                values = [number(found["before"]), number(found["after"]), ratio]
                title = f"{name}: {OF[each['of']]} {inside(title_of(each['kpi']))}"
                unit = f" [{unit_of(each['kpi'])}]" if unit_of(each["kpi"]) else ""
                held = {True: "holds", False: "broken", None: ""}[found.get("held_after")]
                limit = [_limit_words(found) if kind == "limits" else "", held] if content["limits"] else []
                rows.append([title + unit if where == "tuning" else "", words, *values, *limit])
    heads = ["", "Drives of the", "Before", "After", "Ratio", *(("Limit", "") if content["limits"] else ())]
    return Table(heads, rows, words=(0, 1, 5, 6)[: len(heads) - 3])


def _limit_words(found: Mapping[str, Any]) -> str:
    named = (("at least", found["at_least"]), ("at most", found["at_most"]))
    return ", ".join(f"{words} {number(limit)}" for words, limit in named if limit is not None)


def settings_section(content: Mapping[str, Any], folder: str) -> Section | None:
    """The best settings beside those of before."""
    if not content["best"] or _as_before(content):
        return None
    rows = [
        [
            name,
            "-" if each["before"] is None else value_words(each["before"]),
            value_words(each["after"]),
            _times(each["before"], each["after"]),
            _choice_words(each["choice"]),
            "at its end" if each["at_end"] else "",
        ]
        for name, each in content["settings"].items()
    ]
    items: list[Item] = [Table(["Setting", "Before", "After", "Ratio", "May be", ""], rows, words=(0, 4, 5))]
    ending = [name for name, each in content["settings"].items() if each["at_end"]]
    if ending:
        items.append(f"At the end of what may be chosen, so that better ones may be beyond: {', '.join(ending)}.")
    items.append(f"They are a scenario file, {folder}/best.toml, of which a campaign or another tuning can be made.")
    return Section("The best settings", items, brief=True)


def _times(before: Any, after: Any) -> str:
    numbers = [value for value in (before, after) if isinstance(value, int | float) and not isinstance(value, bool)]
    return f"{after / before:.3g}" if len(numbers) == 2 and before else "-"


def _choice_words(choice: Any) -> str:
    if isinstance(choice, Mapping):
        if "from" in choice:
            return f"{value_words(choice['from'])} to {value_words(choice['to'])}"
        if "among" in choice:
            return value_words(choice["among"])
        return f"{value_words(choice['low'])} to {value_words(choice['high'])}, {choice['distribution']}"
    return value_words(choice)
