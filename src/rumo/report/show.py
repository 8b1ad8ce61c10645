"""A quick look at any log."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rumo.report.charts import LIMIT, REFERENCE
from rumo.report.figures import DASHES, STYLE
from rumo.simulation.log import names, signal

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


def show(log: xr.Dataset) -> Figure:
    """Draw every plant state and every input of a run over time, references and limits with them.

    Parameters
    ----------
    log : xarray.Dataset
        From `rumo.simulate`.

    Returns
    -------
    matplotlib.figure.Figure
        Shown at once in a notebook or an interactive session; elsewhere, `figure.savefig(...)`.
    """
    import matplotlib.pyplot as plt

    time = log["time"].to_numpy()
    states, inputs, outputs = names(log, "plant_state"), names(log, "input"), names(log, "output")
    rows = [(name, "plant", "plant_state") for name in states] + [(name, "applied", "input") for name in inputs]
    with plt.rc_context(STYLE):
        figure, grid = plt.subplots(
            (len(rows) + 1) // 2,
            2,
            sharex=True,
            squeeze=False,
            layout="constrained",
            figsize=(9.0, 0.9 * len(rows) + 1.5),
        )
        for axes, (name, variable, dim) in zip(grid.flat, rows, strict=False):
            held = variable == "applied"
            axes.plot(time, signal(log, variable, name), label=name, drawstyle="steps-post" if held else "default")
            if name in outputs:
                axes.plot(
                    time,
                    signal(log, "reference", name),
                    color=REFERENCE.color,
                    linestyle=DASHES[REFERENCE.dash],
                    label="reference",
                )
            if held:
                for bound in ("input_lower", "input_upper"):
                    limit = float(log[bound].sel(input=name))
                    if np.isfinite(limit):
                        axes.axhline(limit, color=LIMIT.color, linestyle=DASHES[LIMIT.dash], linewidth=1.0)
            unit = str(log[f"{dim}_unit"].sel({dim: name}).item())
            axes.set_ylabel(name if unit == "1" else f"{name} [{unit}]")
        for axes in grid.flat[len(rows) :]:
            axes.set_visible(False)
        for axes in (grid[-1, 0], grid[len(rows) // 2 - 1, 1]):
            axes.set_xlabel("Time [s]")
            axes.tick_params(labelbottom=True)
        figure.suptitle(str(log.attrs["title"]))
    if plt.isinteractive():
        plt.show()
    return figure
