"""A loop run to its end, and its log."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from typing import TYPE_CHECKING

from rumo.interrupts import Interrupted
from rumo.simulation.loop import ClosedLoop
from rumo.simulation.recorder import Recorder

if TYPE_CHECKING:
    import xarray as xr


def record(loop: ClosedLoop, progress: Callable[[int, int], None] | None = None) -> xr.Dataset:
    """Run a loop to its end and return the log, see `Scenario.run`."""
    recorder = Recorder(
        loop.controller, loop.plant, measured=loop.measured, observed=loop.scenario.observed, seed=loop.scenario.seed
    )
    try:
        with closing(iter(loop)) as samples:
            for sample in samples:
                recorder.record(sample)
                if progress is not None:
                    progress(sample.index + 1, len(loop))
    except BaseException as error:
        log = recorder.log().assign_attrs(complete="no")
        if isinstance(error, KeyboardInterrupt):
            raise Interrupted(log) from None
        vars(error)["log"] = log
        error.add_note("The run until then is the attribute log of this exception.")
        raise
    return recorder.log()
