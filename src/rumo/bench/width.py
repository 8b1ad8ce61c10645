"""How a step grows with the number of states: similar drives on models of one family."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rumo.bench.measuring import measure
from rumo.bench.report import PHASES, microseconds, percentiles_of_phases
from rumo.bench.runners import installed
from rumo.controllers import RealTimeIteration
from rumo.problem import Problem
from rumo.report.contents import Report, Section
from rumo.report.machine import machine
from rumo.report.tables import Table, number
from rumo.simulation.replay import Recording
from rumo.terms import Weight
from rumo.textbook import heat_rod, mass_chain

RIVAL = "casadi-osqp-wide"
"""The sparse equations as they are, for a QP solver that knows no stages. Not compiled, which takes minutes; with a
step size of OSQP that suits rods: faster and more accurate than its own."""
RIVALS = (RIVAL, "acados", "acados-discrete")
HEADS = {RIVAL: "CasADi, OSQP"}
STEPS = 60
"""Samples of a drive."""


@dataclass(frozen=True)
class Family:
    """Models of any width.

    Parameters
    ----------
    problem : callable
        From a number of states to a problem with one tracked output, a state.
    widths : tuple of int
        Numbers of states that are measured.
    rest, step : float
        Each state when nothing happens; how far the reference moves, and back.
    rivals : tuple of str
        Who solves the same problem: `RUNNERS`, of which those that are not installed are left out.
    """

    problem: Callable[[int], Problem]
    widths: tuple[int, ...]
    rest: float
    step: float
    rivals: tuple[str, ...] = RIVALS


def rod(cells: int) -> Problem:
    """Hold the temperature in the middle of a rod, which is heated at one end; the other stays at 20 degC."""
    return Problem(
        heat_rod(cells),
        horizon=20,
        sampling_time=10.0,
        delay=1,
        track={f"t_{cells // 2 + 1}": Weight(1.0, range=10.0)},
        moves={"heating": Weight(0.01, range=3e4)},
        bounds={"heating": (0.0, 3e4)},
    )


def chain(states: int) -> Problem:
    """Place the first of masses between springs by the force on it."""
    return Problem(
        mass_chain(states // 2),
        horizon=40,
        sampling_time=0.5,
        delay=1,
        track={"x_1": Weight(1.0, range=0.5)},
        moves={"force": Weight(0.01, range=1.0)},
        bounds={"force": (-0.5, 0.5)},
    )


FAMILIES = {
    "heat-rod": Family(rod, (10, 20, 40, 80, 160), rest=20.0, step=8.0, rivals=(RIVAL,)),
    "mass-chain": Family(chain, (20, 24, 30), rest=0.0, step=0.3),
}
"""By name. acados has no use for a rod's sparsity, and takes long to compile one."""


def drive(family: Family, width: int) -> Recording:
    """Follow steps of the reference, which input limits slow down, with the prediction as the plant."""
    problem = family.problem(width)
    controller = RealTimeIteration(problem)
    x = np.full(len(problem.model.states), family.rest)
    wanted = family.rest + family.step * (np.arange(STEPS + problem.horizon + 1) // (STEPS // 4) % 2)
    states, references, applied = [], [], []
    for k in range(STEPS):
        reference = wanted[k : k + problem.horizon + 1, None]
        states.append(x)
        references.append(reference)
        applied.append(np.array(controller.applied))
        x = controller.step(x, reference).x.values[1]
    return Recording(problem, np.array(states), np.array(references), np.array(applied))


def measure_width(name: str, width: int) -> dict[str, Any]:
    """Percentiles of each phase and controller."""
    family = FAMILIES[name]
    recording = drive(family, width)
    rivals = [rival for rival in family.rivals if installed(rival)]
    times = measure(recording, ["rti", *rivals])
    controllers = {controller: percentiles_of_phases(values) for controller, values in times.items()}
    return {"family": name, "width": width, "horizon": recording.problem.horizon, "controllers": controllers}


def exponent(widths: Sequence[float], times: Sequence[float]) -> float:
    """Of a power of the width, fitted in logarithms."""
    return float(np.polyfit(np.log(widths), np.log(times), 1)[0])


def width_report(runs: Sequence[Mapping[str, Any]]) -> Report:
    """Of each family: medians by width, their ratios to ours, and the exponents of the widths."""
    families: dict[str, list[Mapping[str, Any]]] = {}
    for run in runs:
        families.setdefault(run["family"], []).append(run)
    exponents = {family: _exponents(here) for family, here in families.items() if len(here) > 1}
    sections = [
        Section(
            f"{family}, N = {here[0]['horizon']}, 1 input; medians in microseconds",
            [_table(here, exponents.get(family, {}))],
            brief=True,
        )
        for family, here in families.items()
    ]
    summary = {"machine": machine(), "runs": list(runs), "exponents": exponents}
    return Report("How wide", "Medians in microseconds", summary, sections)


def _exponents(runs: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, float]]:
    """By controller and phase; a rival that is called as a whole has no preparation to speak of."""
    widths = [run["width"] for run in runs]
    return {
        name: {
            phase: exponent(widths, [run["controllers"][name][phase]["p50"] for run in runs])
            for phase in (PHASES if name == "rti" else PHASES[-1:])
        }
        for name in runs[0]["controllers"]
    }


def _table(runs: Sequence[Mapping[str, Any]], exponents: Mapping[str, Mapping[str, float]]) -> Table:
    rivals = [name for name in runs[0]["controllers"] if name != "rti"]
    rows: list[list[str]] = []
    for run in runs:
        ours = [run["controllers"]["rti"][phase]["p50"] for phase in PHASES]
        row = [number(run["width"]), *map(microseconds, ours)]
        for rival in rivals:
            theirs = run["controllers"][rival][PHASES[-1]]["p50"]
            row += [microseconds(theirs), f"{theirs / ours[-1]:.1f}"]
        rows.append(row)
    if exponents:
        fitted = [f"{value:.2f}" for value in exponents["rti"].values()]
        for rival in rivals:
            fitted += [f"{exponents[rival][PHASES[-1]]:.2f}", ""]
        rows.append(["exponent", *fitted])
    heads = ["states", *(f"rti\n{phase.removesuffix('_us')}" for phase in PHASES)]
    for rival in rivals:
        heads += [f"{HEADS.get(rival, rival)}\ntotal", "ratio"]
    return Table(heads, rows)
