"""The paper's case study: a car follows a sine path in wind, with noisy sensors."""

from rumo.studies.paper.study import (
    CLOSE_WEIGHTS,
    FILTER,
    HORIZON,
    NOISE,
    PATH,
    PENALTY,
    RUN,
    SAMPLING_TIME,
    TRACKED,
    TYRE,
    WIND,
    PaperStudy,
    kalman_filter,
    paper_weights,
    reference_ranges,
)

__all__ = [
    "CLOSE_WEIGHTS",
    "FILTER",
    "HORIZON",
    "NOISE",
    "PATH",
    "PENALTY",
    "RUN",
    "SAMPLING_TIME",
    "TRACKED",
    "TYRE",
    "WIND",
    "PaperStudy",
    "kalman_filter",
    "paper_weights",
    "reference_ranges",
]
