"""A loop run to its end, and its log."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from typing import TYPE_CHECKING

from rumo.interrupts import Interrupted
from rumo.simulation.loop import ClosedLoop
from rumo.simulation.recorder import Recorder
from rumo.simulation.sample import Sample

if TYPE_CHECKING:
    import xarray as xr


def record(
    loop: ClosedLoop,
    progress: Callable[[int, int], None] | None = None,
    until: Callable[[Sample], bool] | None = None,
) -> xr.Dataset:
    """Run a loop and return the log, see `Scenario.run`: to its end, or to the first sample of which `until` is true.

    The input of this last sample is recorded, and no longer applied.
    """
    recorder = Recorder(
        loop.controller,
        loop.plant,
        measured=loop.measured,
        observed=loop.scenario.observed,
        actuated=loop.scenario.actuation is not None,
        monitors=loop.monitors.signals,
        seed=loop.scenario.seed,
    )
    try:
        with closing(iter(loop)) as samples:
            for sample in samples:
                recorder.record(sample)
                if progress is not None:
                    progress(sample.index + 1, len(loop))
                if until is not None and until(sample):
                    break
    except BaseException as error:
        log = _log(recorder, loop).assign_attrs(complete="no")
        if isinstance(error, KeyboardInterrupt):
            raise Interrupted(log) from None
        vars(error)["log"] = log
        error.add_note("The run until then is the attribute log of this exception.")
        raise
    return _log(recorder, loop)


def _log(recorder: Recorder, loop: ClosedLoop) -> xr.Dataset:
    log, expected = recorder.log(), loop.monitors.expected
    if expected:
        log = log.assign_coords(expected_delay=("monitor", list(expected.values()), {"units": "s"}))
    return log.assign_attrs(lead_s=loop.lead) if loop.lead else log
