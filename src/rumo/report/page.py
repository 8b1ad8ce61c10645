"""One self-contained HTML page with interactive figures, by Plotly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

from rumo.report.charts import Chart, Panels
from rumo.report.plots import plot
from rumo.report.tables import Table

STYLE = """
:root { color-scheme: light; }
body { font: 16px/1.5 system-ui, sans-serif; color: #1b1f24; max-width: 68rem; margin: 0 auto; padding: 1.5rem; }
h1 { margin-bottom: 0; } h2 { margin: 2.5rem 0 .5rem; }
p.lead { margin-top: .25rem; color: #57606a; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th, td { text-align: right; padding: .35rem .7rem; border-bottom: 1px solid #d8dee4; }
th:first-child, td:first-child { text-align: left; }
.scroll { overflow-x: auto; }
"""

CONFIG = {"displaylogo": False, "modeBarButtonsToRemove": ["select2d", "lasso2d"]}


@dataclass(frozen=True)
class Section:
    """A heading, and the sentences, tables and figures below it."""

    heading: str
    content: Sequence[str | Table | Chart | Panels]


def write_page(path: Path, title: str, lead: str, sections: Sequence[Section], style: str = "") -> Path:
    """Write a study's report.

    Parameters
    ----------
    path : Path
        The HTML file.
    title, lead : str
        Heading, and the sentence below it.
    sections : sequence of Section
        What it shows, in order.
    style : str
        More CSS than the pages share.
    """
    from plotly.offline import get_plotlyjs

    body = "\n".join(
        f"<h2>{escape(section.heading)}</h2>" + "\n".join(map(_html, section.content)) for section in sections
    )
    html = f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{escape(title)}</title><style>{STYLE}{style}</style>
<script>{get_plotlyjs()}</script></head><body>
<h1>{escape(title)}</h1><p class="lead">{escape(lead)}</p>
{body}
</body></html>
"""
    path.write_text(html, encoding="utf-8")
    return path


def _html(content: str | Table | Chart | Panels) -> str:
    if isinstance(content, str):
        return f"<p>{escape(content)}</p>"
    if isinstance(content, Table):
        return _table(content)
    return plot(content).to_html(full_html=False, include_plotlyjs=False, div_id=content.key, config=CONFIG)


def _table(table: Table) -> str:
    head = "".join(f"<th>{escape(text)}</th>" for text in table.heads)
    body = "".join("<tr>" + "".join(f"<td>{escape(text)}</td>" for text in row) + "</tr>" for row in table.rows)
    return f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'
