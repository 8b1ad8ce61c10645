"""Which estimator a car needs: an extended Kalman filter and a moving horizon in closed loop, question by question."""

from rumo.studies.estimation.contenders import CONTENDERS, Contender
from rumo.studies.estimation.questions import QUESTIONS, Question
from rumo.studies.estimation.study import EstimationRun, EstimationStudy, Judged

__all__ = [
    "CONTENDERS",
    "QUESTIONS",
    "Contender",
    "EstimationRun",
    "EstimationStudy",
    "Judged",
    "Question",
]
