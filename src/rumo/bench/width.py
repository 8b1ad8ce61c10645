"""How a step grows with the number of states: the same drive on models of one family."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from rumo.bench.measuring import measure
from rumo.bench.report import PHASES, microseconds, percentiles_of_phases
from rumo.controllers import RealTimeIteration
from rumo.problem import Problem
from rumo.report.contents import Report, Section
from rumo.report.machine import machine
from rumo.report.tables import Table, number
from rumo.simulation.replay import Recording
from rumo.terms import Weight
from rumo.textbook import heat_rod

WIDTHS = (10, 20, 40, 80, 160)
RIVAL = "casadi-osqp-wide"
"""The sparse equations as they are, for a QP solver that knows no stages. Not compiled, which takes minutes; with a
step size of OSQP that suits rods: faster and more accurate than its own."""
STEPS = 60
"""Samples of a drive."""
HORIZON, SAMPLING_TIME = 20, 10.0


def rod(cells: int) -> Problem:
    """Hold the temperature in the middle of a rod, which is heated at one end; the other stays at 20 degC."""
    return Problem(
        heat_rod(cells),
        horizon=HORIZON,
        sampling_time=SAMPLING_TIME,
        delay=1,
        track={f"t_{cells // 2 + 1}": Weight(1.0, range=10.0)},
        moves={"heating": Weight(0.01, range=3e4)},
        bounds={"heating": (0.0, 3e4)},
    )


FAMILIES: dict[str, Callable[[int], Problem]] = {"heat-rod": rod}
"""By name: from a number of states to a problem whose first tracked output is a state at 20 when nothing happens."""


def drive(problem: Problem) -> Recording:
    """Follow steps of the reference, which input limits slow down, with the prediction as the plant."""
    controller = RealTimeIteration(problem)
    x = np.full(len(problem.model.states), 20.0)
    wanted = 20.0 + 8.0 * (np.arange(STEPS + problem.horizon + 1) // (STEPS // 4) % 2)
    states, references, applied = [], [], []
    for k in range(STEPS):
        reference = wanted[k : k + problem.horizon + 1, None]
        states.append(x)
        references.append(reference)
        applied.append(np.array(controller.applied))
        x = controller.step(x, reference).x.values[1]
    return Recording(problem, np.array(states), np.array(references), np.array(applied))


def measure_width(family: str, width: int) -> dict[str, Any]:
    """Percentiles of each phase and controller."""
    times = measure(drive(FAMILIES[family](width)), ["rti", RIVAL])
    controllers = {name: percentiles_of_phases(values) for name, values in times.items()}
    return {"family": family, "width": width, "horizon": HORIZON, "controllers": controllers}


def exponent(widths: Sequence[float], times: Sequence[float]) -> float:
    """Of a power of the width, fitted in logarithms."""
    return float(np.polyfit(np.log(widths), np.log(times), 1)[0])


def width_report(runs: Sequence[Mapping[str, Any]]) -> Report:
    """Of each family: medians by width, their ratio, and the exponents of the widths."""
    families: dict[str, list[Mapping[str, Any]]] = {}
    for run in runs:
        families.setdefault(run["family"], []).append(run)
    exponents = {family: _exponents(here) for family, here in families.items() if len(here) > 1}
    sections = [
        Section(
            f"{family}, N = {HORIZON}, 1 input; medians in microseconds",
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
    phases = {"rti": PHASES, RIVAL: PHASES[-1:]}
    return {
        name: {phase: exponent(widths, [run["controllers"][name][phase]["p50"] for run in runs]) for phase in of}
        for name, of in phases.items()
    }


def _table(runs: Sequence[Mapping[str, Any]], exponents: Mapping[str, Mapping[str, float]]) -> Table:
    rows: list[list[str]] = []
    for run in runs:
        ours = [run["controllers"]["rti"][phase]["p50"] for phase in PHASES]
        theirs = run["controllers"][RIVAL][PHASES[-1]]["p50"]
        rows.append([number(run["width"]), *map(microseconds, [*ours, theirs]), f"{theirs / ours[-1]:.2f}"])
    if exponents:
        fitted = [*exponents["rti"].values(), *exponents[RIVAL].values()]
        rows.append(["exponent", *(f"{value:.2f}" for value in fitted), ""])
    heads = ["states", *(f"rti\n{phase.removesuffix('_us')}" for phase in PHASES), "CasADi, OSQP\ntotal", "ratio"]
    return Table(heads, rows)
