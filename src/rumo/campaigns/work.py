"""One run of a campaign, from its task to its row: what engines call by name, wherever they are."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from contextlib import suppress
from datetime import UTC, datetime
from importlib.metadata import version
from inspect import signature
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import TYPE_CHECKING, Any

from rumo.campaigns.judging.columns import KPI, RUN, STATUS
from rumo.campaigns.judging.criteria import Criterion
from rumo.campaigns.tasks.limits import unlimited
from rumo.campaigns.tasks.task import ChangedError
from rumo.controllers import Controller
from rumo.errors import ArgumentError
from rumo.scenarios import Recipe
from rumo.scenarios.contents import digest, is_file
from rumo.scenarios.differences import CONTENT, differences
from rumo.simulation import Scenario, save
from rumo.studies.base import shared_controller
from rumo.studies.drive.run import DriveRun, to_its_end
from rumo.studies.kpis import KPIS, driven, kpis
from rumo.version import __version__

if TYPE_CHECKING:
    import xarray as xr

CONTROLLER = "controller"
"""The setting that says who drives."""
WORK = "rumo.campaigns.work:run"
"""By which engines know it."""
TIMES = ("step_time", "deadline_misses")
"""Figures of merit that differ whenever a run is made."""
STEP_TIMES = ("p50", "p99", "max")
"""Of which these are kept."""
PACKAGES = ("casadi", "numpy", "scipy")
"""Installed packages that compute something, of which rows have the versions."""
COUNTS = "status_counts"
FAILED, ALL, NONE = LOGS = ("failed", "all", "none")
"""Of which runs the log is kept at once: those that fail a criterion, all, or none."""

CHANGED = "With the files that it began with, start it again to go on; else start it in another folder."
"""The cure where they are others."""


def load() -> None:
    """Import what logs and figures of merit need, which is outside of all runs' time then: by a log of one sample."""
    import xarray as xr

    log = xr.Dataset({"signal": ("time", [0.0, 1.0])}, {"time": [0.0, 1.0]}).sel(time=[0.0])
    with TemporaryDirectory() as folder, suppress(OSError):  # without room for it, runs that keep none go on
        log.to_netcdf(Path(folder) / "log.nc", engine="h5netcdf")


def prepare(common: Mapping[str, Any]) -> None:
    """Do once what all runs share: kernels are compiled, however long that takes."""
    for name in common.get("controllers", ()):
        scenario = scenario_of(task_run(common, {"controller": name, "settings": common.get("first", {})}))
        if scenario is not None:
            with unlimited():
                shared_controller(scenario)


def run(common: Mapping[str, Any], task: Mapping[str, Any]) -> dict[str, Any]:
    """Make the run of a task; the same task gives the same row, but for columns that begin with `run.`.

    Parameters
    ----------
    common : mapping
        `recipe`; `first`, settings to prepare for, and `controllers`; `kpis`, names in `rumo.studies.kpis.KPIS`;
        `criteria` as plain data, by name; `logs`, one of `LOGS`.
    task : mapping
        `controller`, and `settings` on top of the recipe's; `log`, whether the log is to be kept, whatever it shows.
        Without that, `logs` and the criteria say whether it is.

    Returns
    -------
    dict of str to None, bool, int, float, str or bytes
        `outcome`, `ended`; figures of merit in `kpi.KEY`, those with parts in `kpi.KEY.PART`; in `status.NAME` how many
        steps had a status; times and versions in `run.NAME`; `log`, the bytes of a NetCDF file, if it is to be kept.

    Raises
    ------
    ChangedError
        If a file that decides it is not what it was when the campaign began.
    Exception
        Whatever the run raises, with an attribute `row`: what is known of it nevertheless, the log until then.
    """
    begun, clock = datetime.now(UTC), perf_counter()
    asked = task.get("log")
    made = task_run(common, task)
    scenario = scenario_of(made)
    controller = None if scenario is None else shared_controller(scenario)
    log: Any = None
    try:
        log = logged(made, controller)
        row = {"outcome": "done", "error": None, "ended": log.attrs.get("ended")}
        row |= figures(made, log, common["kpis"])
    except Exception as error:
        log = getattr(error, "log", log)
        known = _machine(controller) | _times(begun, clock)
        wanted = common.get("logs") != NONE if asked is None else asked
        vars(error)["row"] = known | ({"log": _bytes(log)} if log is not None and wanted else {})
        raise
    row |= _machine(controller) | _times(begun, clock)
    if _wanted(common, row) if asked is None else asked:
        row["log"] = _bytes(log)
    return row


def task_run(common: Mapping[str, Any], task: Mapping[str, Any]) -> Any:
    """The run of a task, before it is run.

    Raises
    ------
    ChangedError
        If a file that decides it is not what it was when the campaign began: its key says what it was.
    """
    try:
        recipe = Recipe.of(common["recipe"])
    except ArgumentError as error:
        got = f"{error.got}, which was not so where the campaign began"
        raise ChangedError(error.argument, got, error.expected, CHANGED) from error
    _require_same(common, task, recipe)
    return recipe.with_settings({**task["settings"], CONTROLLER: task["controller"]}).run()


def _require_same(common: Mapping[str, Any], task: Mapping[str, Any], recipe: Recipe) -> None:
    """Raise unless files hold what they did when the key was made."""
    files, now = task.get("files", {}), recipe.identity
    then = {**common.get("identity", now), **{name: {CONTENT: content} for name, content in files.items()}}
    now |= {name: {CONTENT: digest(Path(name))} if is_file(Path(name)) else None for name in files}
    if now != then:
        got = f"{recipe.base}, of which a file has changed since the campaign began, or is another one here"
        expected = "the files that it began with"
        raise ChangedError("scenario", f"{got} ({differences(then, now)})", expected, CHANGED)


def scenario_of(run: Any) -> Scenario | None:
    """The scenario that a run is of, or is itself."""
    found = run if isinstance(run, Scenario) else getattr(run, "scenario", None)
    return found if isinstance(found, Scenario) else None


def logged(run: Any, controller: Controller | None) -> xr.Dataset:
    """The log of a run, by a controller that is there already if it can be; a car in a spin is one that is lost."""
    takes = controller is not None and "controller" in signature(run.run).parameters
    given: dict[str, Any] = {"controller": controller} if takes else {}
    return to_its_end(lambda: run.run(**given)) if isinstance(run, DriveRun) else run.run(**given)


def figures(run: Any, log: xr.Dataset, names: Any) -> dict[str, Any]:
    """Figures of merit, counts of statuses and step times of a log, as columns of a row."""
    found = kpis(driven(run, log), dict.fromkeys((*names, COUNTS, *TIMES)))
    keys = {name: KPIS[name].key for name in (COUNTS, *TIMES)}
    counts, steps, misses = (found.pop(keys[name]) for name in (COUNTS, *TIMES))
    columns: dict[str, Any] = {}
    for key, value in found.items():
        columns |= (
            {f"{KPI}{key}.{part}": each for part, each in value.items()}
            if isinstance(value, Mapping)
            else {f"{KPI}{key}": value}
        )
    columns |= {f"{STATUS}{name}": count for name, count in counts.items()}
    columns |= {f"{RUN}step_time_{name}_us": (steps or {}).get(name) for name in STEP_TIMES}
    return columns | {f"{RUN}deadline_misses": misses}


def _wanted(common: Mapping[str, Any], row: Mapping[str, Any]) -> bool:
    logs = common.get("logs", FAILED)
    criteria = [Criterion.of(name, table) for name, table in common.get("criteria", {}).items()]
    return logs == ALL or (logs == FAILED and any(criterion.why(row) for criterion in criteria))


def _times(begun: datetime, clock: float) -> dict[str, Any]:
    """When a run began and what it has taken until now: the bytes of its log are not among that."""
    return {f"{RUN}started": begun.isoformat(timespec="seconds"), f"{RUN}wall_time_s": perf_counter() - clock}


def _bytes(log: xr.Dataset) -> bytes:
    with TemporaryDirectory() as folder:
        return save(log, Path(folder) / "log.nc").read_bytes()


def _machine(controller: Controller | None) -> dict[str, Any]:
    return {
        f"{RUN}host": platform.node(),
        f"{RUN}rumo": __version__,
        f"{RUN}machine": f"{platform.system()} {platform.machine()}",
        f"{RUN}python": platform.python_version(),
        **{f"{RUN}{name}": version(name) for name in PACKAGES},
        f"{RUN}backend": getattr(controller, "backend", None),
    }
