"""Charts and panels as interactive figures, by Plotly."""

from __future__ import annotations

from typing import Any

import numpy as np

from rumo.report.charts import COLUMNS, LIMIT, Chart, Line, Panels, bins


def plot(content: Chart | Panels) -> Any:
    """A chart or panels as a Plotly figure."""
    return _plot_panels(content) if isinstance(content, Panels) else _plot_chart(content)


def _plot_chart(chart: Chart) -> Any:
    import plotly.graph_objects as go

    figure = go.Figure()
    for line in chart.lines:
        figure.add_scatter(**_curve(line))
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
    _scale(figure, chart)
    if chart.equal:
        figure.update_yaxes(scaleanchor="x", scaleratio=1)
    return figure


def _plot_panels(content: Panels) -> Any:
    import plotly.subplots

    subplots: Any = plotly.subplots.make_subplots  # its type hints leave out much of what it takes
    figure = subplots(
        content.rows,
        COLUMNS,
        shared_xaxes="all" if "x" in content.shared else False,
        shared_yaxes="all" if "y" in content.shared else False,
        subplot_titles=[title for title, _ in content.panels],
        x_title=content.x_label,
        y_title=content.y_label,
        horizontal_spacing=0.04 if "y" in content.shared else 0.08,
        vertical_spacing=0.07,
    )
    for i, (_, lines) in enumerate(content.panels):
        place = {"row": i // COLUMNS + 1, "col": i % COLUMNS + 1}
        for line in reversed(lines):
            figure.add_scatter(**_curve(line), legendgroup=line.name, showlegend=i == 0, **place)
        if content.shaded is not None:
            x0, x1 = content.shaded
            figure.add_vrect(x0=x0, x1=x1, fillcolor=LIMIT.color, opacity=0.15, line_width=0, layer="below", **place)
    if content.shaded is not None:
        # A shaded region has no entry in the legend of its own.
        square = {"symbol": "square", "size": 12, "color": LIMIT.color}
        figure.add_scatter(x=[None], y=[None], name="Bad samples", mode="markers", marker=square, opacity=0.15)
    _scale(figure, content)
    figure.update_xaxes(showticklabels=True)
    if content.from_zero:
        figure.update_yaxes(rangemode="tozero")
    figure.update_layout(
        title=content.title,
        template="plotly_white",
        height=round(120 + 130 * content.height * content.rows),
        legend={
            "orientation": "h",
            "yanchor": "bottom",
            "y": 1.04,
            "xanchor": "right",
            "x": 1.0,
            "traceorder": "reversed",
        },
        margin={"l": 70, "r": 20, "t": 90, "b": 60},
        hovermode="x unified",
    )
    return figure


def _scale(figure: Any, content: Chart | Panels) -> None:
    if "x" in content.logarithmic:
        figure.update_xaxes(type="log", exponentformat="power")
    if "y" in content.logarithmic:
        figure.update_yaxes(type="log", exponentformat="power")


def _curve(line: Line) -> dict[str, Any]:
    return {
        "x": line.x,
        "y": line.y,
        "name": line.name,
        "mode": "lines+markers" if line.look.marker else "lines",
        "marker": {"symbol": line.look.marker or "circle", "size": 7},
        "line": {
            "color": line.look.color,
            "dash": line.look.dash,
            "width": 1.3 * line.look.width,
            "shape": "hv" if line.steps else "linear",
        },
    }
