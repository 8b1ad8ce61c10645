"""Small multiples: many panels of one scale, as PNG and PDF by matplotlib and interactive by Plotly."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rumo.report.charts import LIMIT, Line
from rumo.report.figures import DASHES, STYLE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = 2


@dataclass(frozen=True)
class Panels:
    """Small multiples: axes of one scale, each with a title, lines, and the time of the bad samples shaded.

    Attributes
    ----------
    key : str
        File name without ending.
    title, x_label, y_label : str
        Labels with units.
    panels : tuple of (str, tuple of Line)
        Title and curves of each.
    shaded : tuple of float
        From when to when samples are bad [s].
    """

    key: str
    title: str
    x_label: str
    y_label: str
    panels: tuple[tuple[str, tuple[Line, ...]], ...]
    shaded: tuple[float, float]

    @property
    def rows(self) -> int:
        """Rows of panels."""
        return -(-len(self.panels) // COLUMNS)

    @property
    def from_zero(self) -> bool:
        """Whether the y axes start at 0, as they do where nothing is negative."""
        return all((line.y >= 0.0).all() for _, lines in self.panels for line in lines)


def draw_panels(content: Panels) -> Figure:
    """Small multiples by matplotlib; the caller saves them."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.0, 1.0 + 1.45 * content.rows), layout="constrained")
        grid = figure.subplots(content.rows, COLUMNS, sharex=True, sharey=True, squeeze=False)
        for axes, (title, lines) in zip(grid.flat, content.panels, strict=False):
            axes.axvspan(*content.shaded, color=LIMIT.color, alpha=0.15, linewidth=0.0, label="Bad samples")
            for line in reversed(lines):
                axes.plot(
                    line.x,
                    line.y,
                    label=line.name,
                    color=line.look.color,
                    linestyle=DASHES[line.look.dash],
                    linewidth=line.look.width,
                    drawstyle="steps-post" if line.steps else "default",
                )
            axes.set_title(title, fontsize=10, loc="left")
            axes.set_ylabel(content.y_label if axes in grid[:, 0] else "")
            axes.margins(x=0.0)
        if content.from_zero:
            grid[0, 0].set_ylim(bottom=0.0)
        for axes in grid.flat[len(content.panels) :]:
            axes.set_visible(False)
        for axes in grid.flat[max(len(content.panels) - COLUMNS, 0) : len(content.panels)]:
            axes.set_xlabel(content.x_label)
            axes.tick_params(labelbottom=True)
        figure.suptitle(content.title, fontsize=11)
        handles, labels = grid[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(handles))
        return figure


def plot_panels(content: Panels) -> Any:
    """Small multiples as a Plotly figure."""
    import plotly.subplots

    subplots: Any = plotly.subplots.make_subplots  # its type hints leave out much of what it takes
    figure = subplots(
        content.rows,
        COLUMNS,
        shared_xaxes="all",
        shared_yaxes="all",
        subplot_titles=[title for title, _ in content.panels],
        x_title=content.x_label,
        y_title=content.y_label,
        horizontal_spacing=0.04,
        vertical_spacing=0.07,
    )
    for i, (_, lines) in enumerate(content.panels):
        place = {"row": i // COLUMNS + 1, "col": i % COLUMNS + 1}
        for line in reversed(lines):
            figure.add_scatter(
                x=line.x,
                y=line.y,
                name=line.name,
                legendgroup=line.name,
                showlegend=i == 0,
                mode="lines",
                line={
                    "color": line.look.color,
                    "dash": line.look.dash,
                    "width": 1.3 * line.look.width,
                    "shape": "hv" if line.steps else "linear",
                },
                **place,
            )
        x0, x1 = content.shaded
        figure.add_vrect(x0=x0, x1=x1, fillcolor=LIMIT.color, opacity=0.15, line_width=0, layer="below", **place)
    # A shaded region has no entry in the legend of its own.
    square = {"symbol": "square", "size": 12, "color": LIMIT.color}
    figure.add_scatter(x=[None], y=[None], name="Bad samples", mode="markers", marker=square, opacity=0.15)
    figure.update_xaxes(showticklabels=True)
    if content.from_zero:
        figure.update_yaxes(rangemode="tozero")
    figure.update_layout(
        title=content.title,
        template="plotly_white",
        height=120 + 190 * content.rows,
        legend={"orientation": "h", "yanchor": "bottom", "y": 1.04, "xanchor": "right", "x": 1.0},
        margin={"l": 70, "r": 20, "t": 90, "b": 60},
        hovermode="x unified",
    )
    return figure


def write_panels(contents: Iterable[Panels], folder: Path) -> list[Path]:
    """Write each as PNG and PDF; the paths written."""
    paths: list[Path] = []
    for content in contents:
        figure = draw_panels(content)
        for ending in ("png", "pdf"):
            paths.append(folder / f"{content.key}.{ending}")
            figure.savefig(paths[-1], metadata={"CreationDate": None} if ending == "pdf" else {})
    return paths
