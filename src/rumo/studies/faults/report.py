"""What became of drives through faults."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rumo.report.charts import REFERENCE, Line, Look, Panels
from rumo.report.contents import Section
from rumo.report.tables import Table, counts, number
from rumo.simulation.log import signal
from rumo.status import Status
from rumo.studies.faults.troubles import FAULTS, Drive
from rumo.studies.kpis import tracking_error
from rumo.studies.looks import label, look

if TYPE_CHECKING:
    import xarray as xr

AROUND = (0.4, 1.6)
"""What figures show before the first bad sample and after the last [s]."""


def sections(content: Mapping[str, Any], drives: Mapping[str, Mapping[str, Drive]]) -> list[Section]:
    """What is shown of a summary, and of the drives by controller and fault."""
    tables = [
        Section(label(name), [faults_table(outcomes)], brief=True) for name, outcomes in content["controllers"].items()
    ]
    return [*tables, Section("Figures", fault_panels(drives))]


def outcome(drive: Drive) -> dict[str, Any]:
    """What became of a drive; None where its log does not say.

    Returns
    -------
    dict
        `bad_commands`: commands not finite or out of bounds, over the whole drive. `exceptions`: 0 or 1.
        `largest_error_m`: largest distance of the plant (not of its measurement) from the reference point, from the
        first bad sample on. `samples_to_recover`: good samples until one is solved, and all after it; 1 is the next.
    """
    log = drive.log
    exceptions = {"exceptions": int(drive.exception is not None), "exception": drive.exception}
    if log is None:
        nothing = dict.fromkeys(("bad_commands", "largest_error_m", "samples_to_recover"))
        return nothing | exceptions | {"status_counts": {}}
    first, end = _bad(log)
    errors = tracking_error(log)[first:]
    commands = log["commanded"].to_numpy()
    within = (commands >= log["input_lower"].to_numpy()) & (commands <= log["input_upper"].to_numpy())
    statuses = [str(status) for status in log["status"].to_numpy()]
    unsolved = [k for k, status in enumerate(statuses[end:]) if not Status[status].solved]
    recovery = unsolved[-1] + 2 if unsolved else 1
    return {
        "bad_commands": int((~within.all(axis=1)).sum()),
        "largest_error_m": float(errors.max()) if errors.size else None,
        "samples_to_recover": recovery if recovery <= len(statuses) - end else None,
        **exceptions,
        "status_counts": dict(Counter(statuses)),
    }


def faults_table(outcomes: Mapping[str, Mapping[str, Any]]) -> Table:
    """How a controller came through each fault, from a summary's entry of it."""
    rows = [
        [
            run["title"],
            number(run["bad_commands"]),
            number(run["exceptions"]),
            "-" if run["largest_error_m"] is None else f"{run['largest_error_m']:.3f}",
            number(run["samples_to_recover"]),
            counts(run["status_counts"]),
        ]
        for run in outcomes.values()
    ]
    heads = ["", "Bad\ncommands", "Exceptions", "Largest\nerror [m]", "Samples to\nrecover", "Statuses"]
    return Table(heads, rows, words=(0, len(heads) - 1))


def fault_panels(drives: Mapping[str, Mapping[str, Drive]]) -> list[Panels]:
    """The error and the steering command around the bad samples, for each controller a panel for each fault."""
    figures: list[Panels] = []
    for name, by_fault in drives.items():
        logs = {fault: drive.log for fault, drive in by_fault.items() if drive.log is not None}
        undisturbed = logs.get("none")
        shown = {fault: log for fault, log in logs.items() if fault != "none"}
        if not shown:
            continue
        first = next(iter(shown.values()))
        dt = float(first.attrs["sampling_time_s"])
        shaded = (dt * _bad(first)[0], dt * _bad(first)[1], "Bad samples")

        def lines(log: xr.Dataset, of: str, undisturbed: xr.Dataset | None = undisturbed, name: str = name) -> Any:
            own = Look(look(name).color, "solid", 1.8)
            both = [("With the fault", log, own), ("No fault", undisturbed, REFERENCE)]
            return tuple(_line(words, run, of, style) for words, run, style in both if run is not None)

        for of, title, y_label in (
            ("error", "Distance from the reference", "Distance [m]"),
            ("steering_rate", "Commanded steering rate", "Rate [rad/s]"),
        ):
            panels = tuple((FAULTS[fault].title, lines(log, of)) for fault, log in shown.items())
            key = f"{of.replace('_', '-')}-{name}"
            figures.append(Panels(key, f"{title}, {label(name)}", "Time [s]", y_label, panels, shaded))
    return figures


def _line(words: str, log: xr.Dataset, of: str, style: Look) -> Line:
    time, dt = log["time"].to_numpy(), float(log.attrs["sampling_time_s"])
    first, end = _bad(log)
    near = (time >= dt * first - AROUND[0]) & (time <= dt * end + AROUND[1])
    if of == "error":
        return Line(words, time[near], tracking_error(log)[near], style)
    return Line(words, time[near], signal(log, "commanded", of)[near], style, steps=True)


def _bad(log: xr.Dataset) -> tuple[int, int]:
    first = int(log.attrs["first_bad_sample"])
    return first, first + int(log.attrs["bad_samples"])
