"""Charts and panels as PNG and PDF, by matplotlib."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rumo.files import write_whole
from rumo.report.charts import (
    FEW_DECADES,
    LIMIT,
    MARKS,
    SCALE,
    Chart,
    Colored,
    HeatMap,
    Line,
    Panels,
    bins,
    on_color,
)
from rumo.report.charts import Figure as Content

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DASHES = {"": "", "solid": "-", "dash": "--", "dot": ":", "dashdot": "-."}
MARKERS = {
    "": "",
    "circle": "o",
    "square": "s",
    "diamond": "D",
    "cross": "P",
    "x": "X",
    "triangle-up": "^",
    "triangle-down": "v",
    "star": "*",
}
LEGEND_COLUMNS = 5
WINDOWLESS = ("agg", "cairo", "pdf", "pgf", "ps", "svg", "template")
"""Backends of matplotlib that only write files."""
ENDINGS = ("png", "pdf")
"""Of the files of a figure."""
STYLE: Any = {
    "figure.figsize": (7.0, 3.6),
    "figure.dpi": 150,
    "font.size": 10,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 11,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "legend.columnspacing": 1.2,
    # The same data give the same file.
    "svg.hashsalt": "rumo",
    "pdf.fonttype": 42,
}


def draw(content: Content) -> Figure:
    """Draw a chart, panels or a heat map; the caller saves it."""
    if isinstance(content, HeatMap):
        return _draw_heat_map(content)
    return _draw_panels(content) if isinstance(content, Panels) else _draw_chart(content)


def _draw_chart(chart: Chart) -> Figure:
    import matplotlib as mpl
    from matplotlib.figure import Figure
    from matplotlib.ticker import FormatStrFormatter, LogLocator, NullLocator

    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.0, chart.height), layout="constrained")
        axes = figure.subplots()
        if chart.colored is not None:
            _add_colored(figure, axes, chart.colored)
        for line in chart.lines:
            _add(axes, line)
        if chart.histogram is not None:
            edges = bins(chart.histogram.y, chart.markers)
            axes.hist(
                chart.histogram.y, bins=edges.tolist(), color=chart.histogram.look.color, label=chart.histogram.name
            )
            for (value, words), dash in zip(chart.markers, MARKS, strict=False):
                axes.axvline(value, color="#000000", linestyle=DASHES[dash], linewidth=1.2, label=words)
            axes.set_xscale("log")
            axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
            axes.xaxis.set_minor_locator(NullLocator())
            axes.set_xlim(edges[0], edges[-1])
        _scale(axes, chart)
        axes.set(title=chart.title, xlabel=chart.x_label, ylabel=chart.y_label)
        if chart.equal:
            axes.set_aspect("equal", adjustable="datalim")
        handles, labels = axes.get_legend_handles_labels()
        if len(handles) > 1:
            # Below the axes the legend covers no data.
            figure.legend(handles, labels, loc="outside lower center", ncols=min(len(handles), LEGEND_COLUMNS))
        return figure


def _draw_panels(content: Panels) -> Figure:
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.0, 1.0 + content.height * content.rows), layout="constrained")
        grid = figure.subplots(
            content.rows, content.columns, sharex="x" in content.shared, sharey="y" in content.shared, squeeze=False
        )
        for axes, (title, lines) in zip(grid.flat, content.panels, strict=False):
            if content.shaded is not None:
                start, end, words = content.shaded
                axes.axvspan(start, end, color=LIMIT.color, alpha=0.15, linewidth=0.0, label=words)
            for line in reversed(lines):
                _add(axes, line)
            axes.set_title(title, fontsize=10, loc="left")
            axes.margins(x=0.0 if content.shaded else 0.05)
            if content.names:
                places, names = zip(*content.names, strict=True)
                axes.set_yticks(places, names)
                axes.set_ylim(min(places) - 0.7, max(places) + 0.7)
            _scale(axes, content)
        for i in content.logarithmic_x:
            _scale_axis(grid.flat[i], "x")
        if content.from_zero:
            for axes in grid.flat[: len(content.panels)]:
                axes.set_ylim(bottom=0.0)
        for axes in grid.flat[len(content.panels) :]:
            axes.set_visible(False)
        for axes in grid.flat[max(len(content.panels) - content.columns, 0) : len(content.panels)]:
            axes.set_xlabel(content.x_label)
            axes.tick_params(labelbottom=True)
        figure.suptitle(content.title, fontsize=11)
        figure.supylabel(content.y_label, fontsize=10)
        named: dict[str, Any] = {}
        for axes in grid.flat[: len(content.panels)]:
            handles, labels = axes.get_legend_handles_labels()
            for handle, label in zip(reversed(handles), reversed(labels), strict=True):
                named.setdefault(label, handle)
        columns = min(len(named), LEGEND_COLUMNS)
        figure.legend(named.values(), named.keys(), loc="outside lower center", ncols=columns)
        return figure


def _draw_heat_map(content: HeatMap) -> Figure:
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context({**STYLE, "axes.grid": False}):
        figure = Figure(figsize=(7.0, content.height), layout="constrained")
        grid = figure.subplots(1, len(content.panels), sharex=True, sharey=True, squeeze=False)
        low, high = content.span
        mesh: Any = None
        for axes, (title, values, _) in zip(grid.flat, content.panels, strict=True):
            rows, cells = values.shape
            mesh = axes.pcolormesh(
                np.arange(cells + 1) - 0.5, np.arange(rows + 1) - 0.5, values, cmap=SCALE, vmin=low, vmax=high
            )
            for y, x in zip(*np.nonzero(np.isfinite(values)), strict=True):
                value = float(values[y, x])
                color = on_color(value, content.span)
                axes.text(x, y, f"{value:.3g}", ha="center", va="center", fontsize=8, color=color)
            axes.set_xticks(content.x.places(cells), content.x.ticks)
            axes.set_yticks(content.y.places(rows), content.y.ticks)
            axes.set_title(title, fontsize=10, loc="left")
        grid[0, 0].set_ylabel(content.y.label)
        figure.supxlabel(content.x.label, fontsize=10)
        figure.colorbar(mesh, ax=list(grid.flat), label=content.label)
        figure.suptitle(content.title, fontsize=11)
        return figure


def forget_unless_windows(figure: Figure) -> None:
    """Let pyplot forget a figure of its own where it could never show it: it would keep it for the whole process."""
    import matplotlib.pyplot as plt

    if plt.get_backend().lower() in WINDOWLESS:
        canvas = figure.canvas
        plt.close(figure)
        figure.set_canvas(canvas)  # which closing may take


def _scale(axes: Any, content: Chart | Panels) -> None:
    for name in content.logarithmic:
        _scale_axis(axes, name)


def _scale_axis(axes: Any, name: str) -> None:
    from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

    getattr(axes, f"set_{name}scale")("log")
    axis = getattr(axes, f"{name}axis")
    low, high = axis.get_view_interval()
    if np.log10(high / low) < FEW_DECADES:  # powers of ten alone would be too few
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(FormatStrFormatter("%g"))
    axis.set_minor_formatter(NullFormatter())


def _add_colored(figure: Figure, axes: Any, curve: Colored) -> None:
    from matplotlib.collections import LineCollection

    points = np.column_stack([curve.x, curve.y])
    ends = list(np.stack([points[:-1], points[1:]], axis=1))
    # Round ends leave no gaps between one piece and the next.
    pieces = LineCollection(ends, array=curve.values[:-1], cmap=SCALE, linewidth=2.6, capstyle="round")
    axes.add_collection(pieces)
    axes.autoscale_view()
    figure.colorbar(pieces, ax=axes, label=curve.label, shrink=0.9)


def _add(axes: Any, line: Line) -> None:
    axes.plot(
        line.x,
        line.y,
        label=line.name,
        color=line.look.color,
        linestyle=DASHES[line.look.dash],
        linewidth=line.look.width,
        marker=MARKERS[line.look.marker],
        markersize=line.look.size,
        drawstyle="steps-post" if line.steps else "default",
    )


def write_figures(contents: Iterable[Content], folder: Path) -> list[Path]:
    """Write each as PNG and PDF; the paths written."""
    paths: list[Path] = []
    for content in contents:
        figure = draw(content)
        figure.draw_without_rendering()  # lays it out, once for both files
        figure.set_layout_engine("none")
        for ending in ENDINGS:
            paths.append(folder / f"{content.key}.{ending}")
            metadata = {"CreationDate": None} if ending == "pdf" else {}
            write_whole(paths[-1], partial(figure.savefig, metadata=metadata))
    return paths
