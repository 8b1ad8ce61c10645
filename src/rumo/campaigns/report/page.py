"""The report of a campaign, from its rows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rumo.campaigns.judging.results import Results
from rumo.campaigns.judging.summary import summary
from rumo.campaigns.report.dependence import dependences
from rumo.campaigns.report.failures import failures_section, made_with
from rumo.campaigns.report.headline import headline
from rumo.campaigns.report.heat import heat_map
from rumo.campaigns.report.pairs import pairs
from rumo.campaigns.report.spread import spreads
from rumo.campaigns.report.sureness import sureness
from rumo.campaigns.report.worst import worst_runs
from rumo.report.contents import Report
from rumo.report.folder import incomplete
from rumo.report.tables import counts, number
from rumo.studies.looks import label


def report(results: Results, stopped: BaseException | None = None) -> Report:
    """Sentences, tables and figures of what came of a campaign, and its summary.

    Parameters
    ----------
    results : Results
        Its rows, criteria and logs; at least one row.
    stopped : BaseException, optional
        What ended it before all runs were done.
    """
    content = summary(results)
    found = [
        headline(content, results),
        worst_runs(content, results),
        spreads(content, results),
        dependences(content, results),
        heat_map(content, results),
        pairs(content, results),
        failures_section(content),
        sureness(content, results, (results.specification,)),
        made_with(content, results),
    ]
    sections = [section for section in found if section is not None]
    found = Report(f"Campaign {results.name}", _lead(results), content, sections, _warning(content, results))
    return (
        found
        if stopped is None
        else incomplete(found, f"{len(results.rows)} of {results.asked} runs are done", stopped)
    )


def _lead(results: Results) -> str:
    names = [label(name) for name in results.controllers]
    drivers = f"{', '.join(names[:-1])} and {names[-1]}" if len(names) > 1 else names[0]
    draws = len(set(results.rows["draw"]))
    each = "each driven by" if draws > 1 else "driven by"
    varied = f"; what varies: {', '.join(results.varied)}" if results.varied else ""
    return f"{number(draws)} {'draws' if draws > 1 else 'draw'}, {each} {drivers}{varied}."


def _warning(content: Mapping[str, Any], results: Results) -> str:
    sentences: list[str] = []
    if results.asked is not None and results.asked > len(results.rows):
        sentences += [
            f"Incomplete: {number(len(results.rows))} of {number(results.asked)} runs are done.",
            "Start the campaign again to go on.",
        ]
    mixed = {name: of["builds"] for name, of in content["controllers"].items() if len(of["builds"]) > 1}
    if mixed:
        words = "; ".join(f"{label(name)}: {counts(builds)}" for name, builds in mixed.items())
        sentences.append(f"Runs were driven by different builds of the core, whose last digits differ ({words}).")
    return " ".join(sentences)
