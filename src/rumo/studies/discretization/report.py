"""Which discretisation scheme predicts how well, at what cost: the report."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rumo.report.contents import Section
from rumo.studies.discretization.charts import discretization_figures
from rumo.studies.discretization.tables import (
    FORGOTTEN,
    cheapest_table,
    order_table,
    outcome_table,
    properties_table,
)

CHEAPEST = (
    "Error of the predicted outputs over the horizon, against CVODES, as a share of their range; time of preparation "
    f"and feedback. Only schemes that forget all but {100.0 * FORGOTTEN:g} % of a small error of a fast state within "
    "the horizon, and whose closed loop was solved at every step."
)
STABILITY = (
    "|R(-1e6)| is what one step leaves of a mode that is a million times faster; below each case the largest step with "
    "which none of its modes grows. Explicit schemes are given as many substeps as that takes."
)
ORDER = "One state that follows a sine: as slow as the sine, and a million times faster (Prothero and Robinson, 1974)."


def sections(content: Mapping[str, Any]) -> list[Section]:
    """What is shown of a summary."""
    return [
        Section("The cheapest step for an accuracy", [CHEAPEST, cheapest_table(content)], brief=True),
        Section("What the figures say", findings(content), brief=True),
        Section("Stability", [STABILITY, properties_table(content)]),
        Section("Order", [ORDER, order_table(content)]),
        Section("Figures", discretization_figures(content)),
        *(Section(case["title"], [outcome_table(case, content["schemes"])]) for case in content["cases"].values()),
    ]


def find(case: Mapping[str, Any], scheme: str, step: float) -> Mapping[str, Any] | None:
    """The outcome of a scheme with intervals of a length [s]; None if not tried."""
    return next((o for o in case["outcomes"] if o["scheme"] == scheme and o["step_s"] == step), None)


def findings(content: Mapping[str, Any]) -> list[str]:
    """What the figures say, case by case, in sentences; only of schemes that were tried."""
    return [sentence for case in content["cases"].values() for sentence in _findings_of(case)]


def _findings_of(case: Mapping[str, Any]) -> list[str]:
    steps = sorted({outcome["step_s"] for outcome in case["outcomes"]}, reverse=True)
    coarse, fine = steps[1], steps[2]
    unit = "" if case["unit"] == "1" else f" {case['unit']}"
    euler, radau, rk4 = find(case, "implicit-euler", fine), find(case, "radau2", coarse), find(case, "rk4", fine)
    sentences: list[str] = []
    if euler is not None and rk4 is not None:
        linearise, whole = (_times(rk4[key] / euler[key]) for key in ("linearize_us", "total_us"))
        sentences.append(
            f"{case['title']}: RK4 needs {_counted(rk4['substeps'], 'substep')} in an interval of {fine:g} s to be "
            f"stable; its linearisation takes {linearise} as long as implicit Euler's, its step {whole}."
        )
    if euler is not None and radau is not None and None not in (euler["error"], radau["error"]):
        sentences.append(
            f"{case['title']}: Radau2 at {coarse:g} s is off by {radau['error']:.2g}{unit} and takes "
            f"{radau['total_us']:.3g} us a step, implicit Euler at {fine:g} s by {euler['error']:.2g}{unit} in "
            f"{euler['total_us']:.3g} us."
        )
    return sentences


def _counted(number: int, what: str) -> str:
    return f"{number:,} {what}{'' if number == 1 else 's'}"


def _times(ratio: float) -> str:
    return f"{ratio:,.0f} times" if ratio >= 10.0 else f"{ratio:.2g} times"
