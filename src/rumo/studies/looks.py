"""How the controllers look in figures, and what readers know them as."""

from __future__ import annotations

from rumo.report.charts import NEUTRAL, Look

LABELS = {"rti": "RTI", "plain": "Plain RTI", "nlp": "Direct NLP", "ltv": "LTV"}
LOOKS = {
    # Runs often coincide: later lines are thinner, so that earlier ones show behind them.
    "rti": Look("#0072B2", "solid", 3.0),
    "plain": Look("#CC79A7", "dot", 2.4),
    "nlp": Look("#E69F00", "dash", 1.8),
    "ltv": Look("#009E73", "dashdot", 1.0),
}


def look(controller: str) -> Look:
    """Look of a controller's lines."""
    return LOOKS.get(controller, NEUTRAL)


def label(controller: str) -> str:
    """Name of a controller for readers."""
    return LABELS.get(controller, controller)
