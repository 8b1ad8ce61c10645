"""What a study's report consists of, for page, terminal and programs alike."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rumo.report.charts import Chart, Panels
from rumo.report.tables import Table


@dataclass(frozen=True)
class Section:
    """A heading, and the sentences, tables and figures below it; those of a `brief` one are on the terminal as well."""

    heading: str
    content: Sequence[str | Table | Chart | Panels]
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
    def figures(self) -> list[Chart | Panels]:
        """All figures, in order."""
        return [item for section in self.sections for item in section.content if isinstance(item, Chart | Panels)]
