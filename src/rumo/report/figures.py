"""Charts as PNG and PDF, by matplotlib."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rumo.report.charts import Chart, bins

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DASHES = {"solid": "-", "dash": "--", "dot": ":", "dashdot": "-."}
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
    # The same data give the same file.
    "svg.hashsalt": "rumo",
    "pdf.fonttype": 42,
}


def draw(chart: Chart) -> Figure:
    """Draw a chart; the caller saves it."""
    import matplotlib as mpl
    from matplotlib.figure import Figure
    from matplotlib.ticker import FormatStrFormatter, LogLocator, NullLocator

    with mpl.rc_context(STYLE):
        figure = Figure(layout="constrained")
        axes = figure.subplots()
        for line in chart.lines:
            axes.plot(
                line.x,
                line.y,
                label=line.name,
                color=line.look.color,
                linestyle=DASHES[line.look.dash],
                linewidth=line.look.width,
                drawstyle="steps-post" if line.steps else "default",
            )
        if chart.histogram is not None and chart.marker is not None:
            value, words = chart.marker
            edges = bins(chart.histogram.y, value)
            axes.hist(
                chart.histogram.y, bins=edges.tolist(), color=chart.histogram.look.color, label=chart.histogram.name
            )
            axes.axvline(value, color="#000000", linestyle="--", linewidth=1.2, label=words)
            axes.set_xscale("log")
            axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
            axes.xaxis.set_minor_locator(NullLocator())
            axes.set_xlim(edges[0], edges[-1])
        axes.set(title=chart.title, xlabel=chart.x_label, ylabel=chart.y_label)
        if chart.equal:
            axes.set_aspect("equal", adjustable="datalim")
        handles, labels = axes.get_legend_handles_labels()
        if len(handles) > 1:
            # Below the axes the legend covers no data.
            figure.legend(handles, labels, loc="outside lower center", ncols=len(handles))
        return figure


def write_figures(charts: Iterable[Chart], folder: Path) -> list[Path]:
    """Write each chart as PNG and PDF; the paths written."""
    paths = []
    for chart in charts:
        figure = draw(chart)
        for ending in ("png", "pdf"):
            path = folder / f"{chart.key}.{ending}"
            figure.savefig(path, metadata={"CreationDate": None} if ending == "pdf" else {})
            paths.append(path)
    return paths
