"""One self-contained HTML page with interactive figures, by Plotly."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from rumo.report.charts import Chart, bins
from rumo.report.tables import Table, claims_table, controllers_table

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


def write_page(path: Path, title: str, lead: str, summary: dict[str, Any], charts: Sequence[Chart]) -> Path:
    """Write a study's report.

    Parameters
    ----------
    path : Path
        The HTML file.
    title, lead : str
        Heading, and the sentence below it.
    summary : dict
        As `summary.json`: `controllers` and `claims` become tables.
    charts : sequence of Chart
        Figures in order.
    """
    from plotly.offline import get_plotlyjs

    figures = "\n".join(
        plot(chart).to_html(full_html=False, include_plotlyjs=False, div_id=chart.key, config=CONFIG)
        for chart in charts
    )
    html = f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{escape(title)}</title><style>{STYLE}</style>
<script>{get_plotlyjs()}</script></head><body>
<h1>{escape(title)}</h1><p class="lead">{escape(lead)}</p>
<h2>Results</h2>{_table(controllers_table(summary["controllers"]))}
<h2>The paper's claims</h2>{_table(claims_table(summary["claims"]))}
<h2>Figures</h2>{figures}
</body></html>
"""
    path.write_text(html, encoding="utf-8")
    return path


def plot(chart: Chart) -> Any:
    """A chart as a Plotly figure."""
    import plotly.graph_objects as go

    figure = go.Figure()
    for line in chart.lines:
        figure.add_scatter(
            x=line.x,
            y=line.y,
            name=line.name,
            mode="lines",
            line={
                "color": line.look.color,
                "dash": line.look.dash,
                "width": 1.3 * line.look.width,
                "shape": "hv" if line.steps else "linear",
            },
        )
    if chart.histogram is not None and chart.marker is not None:
        value, words = chart.marker
        edges = bins(chart.histogram.y, value)
        counts, _ = np.histogram(chart.histogram.y, edges)
        figure.add_bar(
            x=np.sqrt(edges[1:] * edges[:-1]),
            y=counts,
            width=np.diff(edges),
            name=chart.histogram.name,
            marker_color=chart.histogram.look.color,
        )
        figure.add_scatter(
            x=[value, value],
            y=[0, counts.max()],
            mode="lines",
            name=words,
            line={"color": "#000000", "dash": "dash", "width": 1.5},
        )
        figure.update_xaxes(type="log", tickvals=[m * 10.0**e for e in range(-4, 5) for m in (1, 2, 5)])
    figure.update_layout(
        title=chart.title,
        xaxis_title=chart.x_label,
        yaxis_title=chart.y_label,
        template="plotly_white",
        height=420,
        showlegend=True,
        legend={"orientation": "h", "yanchor": "top", "y": -0.2, "x": 0.0},
        margin={"l": 70, "r": 20, "t": 50, "b": 60},
        hovermode="closest" if chart.equal or chart.histogram else "x unified",
    )
    if chart.equal:
        figure.update_yaxes(scaleanchor="x", scaleratio=1)
    return figure


def _table(table: Table) -> str:
    head = "".join(f"<th>{escape(text)}</th>" for text in table.heads)
    body = "".join("<tr>" + "".join(f"<td>{escape(text)}</td>" for text in row) + "</tr>" for row in table.rows)
    return f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'
