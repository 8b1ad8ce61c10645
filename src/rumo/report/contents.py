"""What a study's report consists of, for page, terminal and programs alike."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rumo.report.charts import Chart, Figure, HeatMap, Panels
from rumo.report.tables import Table


@dataclass(frozen=True)
class Command:
    """What can be typed into a terminal."""

    text: str


@dataclass(frozen=True)
class Beside:
    """Figures side by side, as far as there is room."""

    content: Sequence[Figure]


@dataclass(frozen=True)
class Folded:
    """What is shown when its heading, a few words, is clicked; or from the beginning, if it is `open`."""

    heading: str
    content: Sequence[Item]
    open: bool = False


Item = str | Table | Figure | Command | Beside | Folded
"""What a section consists of."""


@dataclass(frozen=True)
class Section:
    """A heading, and the sentences, tables and figures below it; those of a `brief` one are on the terminal as well."""

    heading: str
    content: Sequence[Item]
    brief: bool = False


@dataclass(frozen=True)
class Report:
    """What came of a study.

    Attributes
    ----------
    title, lead : str
        Heading of the page, and the sentence below it.
    summary : mapping
        Content of `summary.json`: numbers, strings, None, lists and mappings.
    sections : sequence of Section
        What is shown, in order.
    warning : str
        What a reader must know before all else, such as that runs are missing; mostly nothing.
    """

    title: str
    lead: str
    summary: Mapping[str, Any]
    sections: Sequence[Section]
    warning: str = ""

    @property
    def figures(self) -> list[Figure]:
        """All figures, in order."""
        return [figure for section in self.sections for item in section.content for figure in _figures(item)]


def _figures(item: Item) -> list[Figure]:
    if isinstance(item, Beside | Folded):
        return [figure for part in item.content for figure in _figures(part)]
    return [item] if isinstance(item, Chart | Panels | HeatMap) else []
