"""Controllers: the same problem, solved in different ways."""

from rumo.controllers.base import Controller
from rumo.controllers.gate import InnovationGate
from rumo.controllers.ltv import LinearTimeVarying
from rumo.controllers.nlp import DirectNlp, NlpOptions
from rumo.controllers.qp import QpOptions
from rumo.controllers.rti import RealTimeIteration

__all__ = [
    "Controller",
    "DirectNlp",
    "InnovationGate",
    "LinearTimeVarying",
    "NlpOptions",
    "QpOptions",
    "RealTimeIteration",
]
