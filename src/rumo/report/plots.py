"""Charts and panels as interactive figures, by Plotly; their titles stand above them on the page."""

from __future__ import annotations

from typing import Any

import numpy as np

from rumo.report.charts import (
    FEW_DECADES,
    LIMIT,
    MARKS,
    SCALE,
    Chart,
    Colored,
    Figure,
    HeatMap,
    Line,
    Panels,
    bins,
    on_color,
)
from rumo.signals import Array

WIDE, NARROW = 740, 330
"""Widths that legends must do with [px]."""
TOP, BELOW = 44, 52
"""Room for the mode bar, and for ticks and label of the lower axis [px]."""
LOG_TICKS = 6
"""On a logarithmic axis, about: of 1, 2, 5 and 10 there is room for each, of 1 to 10 there is not."""
CHART, PRINTED, ROW = 330, 3.6, 135
"""Height of a chart [px] that is so high in print [inch], and of a row of panels for each inch [px]."""


def plot(content: Figure) -> Any:
    """A chart, panels or a heat map as a Plotly figure."""
    if isinstance(content, HeatMap):
        return _plot_heat_map(content)
    return _plot_panels(content) if isinstance(content, Panels) else _plot_chart(content)


def template() -> dict[str, Any]:
    """What all figures look like; it is not repeated in each."""
    import plotly.io

    return plotly.io.templates["plotly_white"].to_plotly_json()


def narrow_layout(content: Figure, figure: Any) -> dict[str, Any]:
    """Changes of a figure's layout on a narrow screen: panels below each other, labels in less room."""
    names = [trace.name for trace in figure.data if trace.showlegend is not False]
    margins = {"l": 64, "r": 10, "t": figure.layout.margin.t, "b": BELOW + _legend_height(names, NARROW)}
    if isinstance(content, Chart):
        return {
            "margin": margins,
            "height": round(0.85 * CHART * content.height / PRINTED) + margins["t"] + margins["b"],
        }
    count, height = len(content.panels), round(ROW * content.height)
    changes: dict[str, Any] = {"margin": margins, "height": height * count + margins["t"] + margins["b"]}
    annotations = [annotation.to_plotly_json() for annotation in figure.layout.annotations]
    gap, titles = 48 / (height * count), 0  # for ticks and title
    for i in range(count):
        top, bottom = (
            1.0 - i / count - (gap / 2 if i else 0.0),
            1.0 - (i + 1) / count + (gap / 2 if i < count - 1 else 0.0),
        )
        number = str(i + 1) if i else ""
        changes |= {f"xaxis{number}.domain": [0.0, 1.0], f"yaxis{number}.domain": [bottom, top]}
        changes[f"yaxis{number}.showticklabels"] = True
        if content.panels[i][0]:  # those without a title have no annotation
            annotations[titles] |= {"x": 0.5, "y": top}
            titles += 1
    return changes | {"annotations": annotations}


def _plot_chart(chart: Chart) -> Any:
    import plotly.graph_objects as go

    figure = go.Figure()
    if chart.colored is not None:
        figure.add_scatter(**_colored(chart.colored))
    for line in chart.lines:
        figure.add_scatter(**_curve(line))
    if chart.histogram is not None:
        edges = bins(chart.histogram.y, chart.markers)
        counts, _ = np.histogram(chart.histogram.y, edges)
        figure.add_bar(
            x=np.sqrt(edges[1:] * edges[:-1]),
            y=counts,
            width=np.diff(edges),
            name=chart.histogram.name,
            marker_color=chart.histogram.look.color,
        )
        for (value, words), dash in zip(chart.markers, MARKS, strict=False):
            line = {"color": "#000000", "dash": dash, "width": 1.5}
            figure.add_scatter(x=[value, value], y=[0, counts.max()], mode="lines", name=words, line=line)
        figure.update_xaxes(type="log", tickvals=[m * 10.0**e for e in range(-4, 5) for m in (1, 2, 5)])
    _lay_out(figure, round(CHART * chart.height / PRINTED))
    figure.update_layout(
        xaxis_title=chart.x_label,
        yaxis_title=chart.y_label,
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
        content.columns,
        shared_xaxes="all" if "x" in content.shared else False,
        shared_yaxes="all" if "y" in content.shared else False,
        subplot_titles=[title for title, _ in content.panels],
        x_title=content.x_label,
        y_title=content.y_label,
        horizontal_spacing=0.04 if "y" in content.shared else 0.09,
        vertical_spacing=0.28 / content.rows if content.rows > 1 else 0.0,
    )
    named: set[str] = set()
    for i, (_, lines) in enumerate(content.panels):
        place = {"row": i // content.columns + 1, "col": i % content.columns + 1}
        for line in reversed(lines):
            figure.add_scatter(**_curve(line), legendgroup=line.name, showlegend=line.name not in named, **place)
            named.add(line.name)
        if content.shaded is not None:
            x0, x1, _ = content.shaded
            figure.add_vrect(x0=x0, x1=x1, fillcolor=LIMIT.color, opacity=0.15, line_width=0, layer="below", **place)
    if content.shaded is not None:
        # A shaded region has no entry in the legend of its own.
        square = {"symbol": "square", "size": 12, "color": LIMIT.color}
        figure.add_scatter(x=[None], y=[None], name=content.shaded[2], mode="markers", marker=square, opacity=0.15)
    _scale(figure, content)
    for i in content.logarithmic_x:
        _, lines = content.panels[i]
        place = {"row": i // content.columns + 1, "col": i % content.columns + 1}
        figure.update_xaxes(_logarithmic([line.x for line in lines]), **place)
    figure.update_xaxes(showticklabels=True)
    if content.names:
        places, names = zip(*content.names, strict=True)
        figure.update_yaxes(tickvals=places, ticktext=names, automargin=True)
    if content.from_zero:
        figure.update_yaxes(rangemode="tozero")
    _lay_out(figure, round(ROW * content.height * content.rows))
    figure.update_layout(
        hovermode="closest" if content.points else "x unified",
        legend_traceorder="reversed",
        height=figure.layout.height + 14,
    )
    figure.update_layout(margin_t=TOP + 14)
    figure.update_annotations(font_size=13)
    figure.update_annotations({"xshift": -50}, selector={"text": content.y_label})  # beside the widest ticks
    return figure


def _plot_heat_map(content: HeatMap) -> Any:
    """Cells are bars: they need no more of Plotly than other figures."""
    import plotly.subplots

    subplots: Any = plotly.subplots.make_subplots
    columns = len(content.panels)
    figure = subplots(
        1,
        columns,
        shared_yaxes=True,
        subplot_titles=[title for title, _, _ in content.panels],
        x_title=content.x.label,
        horizontal_spacing=0.04,
    )
    for i, (_, values, counts) in enumerate(content.panels):
        y, x = np.nonzero(np.isfinite(values))
        found = values[y, x]
        figure.add_bar(
            x=x,
            y=np.ones(len(x)),
            base=y - 0.5,
            width=1.0,
            marker={"color": found, "coloraxis": "coloraxis", "line": {"color": "#ffffff", "width": 1}},
            text=[f"{value:.3g}" for value in found],
            textposition="inside",
            insidetextanchor="middle",
            textangle=0,
            insidetextfont={"color": [on_color(value, content.span) for value in found]},
            customdata=counts[y, x],
            hovertemplate="%{text}, of %{customdata} runs<extra></extra>",
            showlegend=False,
            row=1,
            col=i + 1,
        )
    rows, cells = content.panels[0][1].shape
    ticks = {"showgrid": False, "zeroline": False}
    figure.update_xaxes(tickvals=content.x.places(cells), ticktext=content.x.ticks, range=[-0.5, cells - 0.5], **ticks)
    figure.update_yaxes(tickvals=content.y.places(rows), ticktext=content.y.ticks, range=[-0.5, rows - 0.5], **ticks)
    figure.update_yaxes(title=content.y.label, automargin=True, col=1)
    low, high = content.span
    scale = {
        "colorscale": SCALE,
        "cmin": low,
        "cmax": high,
        "colorbar": {"title": {"text": content.label, "side": "right"}},
    }
    _lay_out(figure, round(CHART * content.height / PRINTED))
    figure.update_layout(barmode="overlay", bargap=0, coloraxis=scale, hovermode="closest", margin_t=TOP + 14)
    figure.update_annotations(font_size=13)
    return figure


def _lay_out(figure: Any, height: int) -> None:
    """The legend below, the mode bar above: neither covers anything."""
    names = [trace.name for trace in figure.data if trace.showlegend is not False]
    below = BELOW + _legend_height(names, WIDE)
    figure.update_layout(
        template=None,
        height=height + TOP + below,
        margin={"l": 70, "r": 20, "t": TOP, "b": below},
        showlegend=True,
        legend={"orientation": "h", "yref": "container", "y": 0.0, "yanchor": "bottom", "x": 0.0, "xanchor": "left"},
    )


def _legend_height(names: list[str], width: int) -> int:
    """Of a horizontal legend, in whose rows all entries are as wide as the widest [px]."""
    in_a_row = max(1, int(width / (48 + 7 * max(map(len, names), default=0))))
    return 20 * -(-len(names) // in_a_row) + 8


def _scale(figure: Any, content: Chart | Panels) -> None:
    lines = content.lines if isinstance(content, Chart) else [line for _, lines in content.panels for line in lines]
    if "x" in content.logarithmic:
        binned = content.histogram if isinstance(content, Chart) else None
        figure.update_xaxes(_logarithmic([*(line.x for line in lines), *([binned.y] if binned is not None else [])]))
    if "y" in content.logarithmic:
        figure.update_yaxes(_logarithmic([line.y for line in lines]))


def _logarithmic(curves: list[Array]) -> dict[str, Any]:
    """A logarithmic axis for such values."""
    axis = {"type": "log", "exponentformat": "power"}
    values = np.concatenate([[], *(np.ravel(curve) for curve in curves)])
    values = values[np.isfinite(values) & (values > 0.0)]
    if not len(values) or np.log10(values.max() / values.min()) >= FEW_DECADES:
        return axis | {"nticks": LOG_TICKS}
    decades = np.arange(np.floor(np.log10(values.min())), np.ceil(np.log10(values.max())) + 1.0)
    ticks = np.outer(10.0**decades, [1.0, 2.0, 5.0]).ravel()
    return axis | {"tickvals": ticks, "ticktext": [f"{tick:g}" for tick in ticks]}


def _colored(curve: Colored) -> dict[str, Any]:
    """Points, close to each other: a line has one colour in Plotly."""
    scale = {"color": curve.values, "colorscale": SCALE, "size": 5, "colorbar": {"title": curve.label}}
    return {"x": curve.x, "y": curve.y, "mode": "markers", "marker": scale, "showlegend": False, "name": curve.label}


def _curve(line: Line) -> dict[str, Any]:
    return {
        "x": line.x,
        "y": line.y,
        "name": line.name,
        "mode": "+".join(["lines"] * bool(line.look.dash) + ["markers"] * bool(line.look.marker)),
        "marker": {"symbol": line.look.marker or "circle", "size": 1.4 * line.look.size},
        "line": {
            "color": line.look.color,
            "dash": line.look.dash or "solid",
            "width": 1.3 * line.look.width,
            "shape": "hv" if line.steps else "linear",
        },
    }
