"""Controllers: the same problem, solved in different ways."""

from rumo.controllers.base import Controller
from rumo.controllers.ltv import LinearTimeVarying
from rumo.controllers.nlp import DirectNlp
from rumo.controllers.rti import RealTimeIteration
from rumo.controllers.settings import (
    ControllerSettings,
    InnovationGate,
    LtvSettings,
    NlpSettings,
    QpOptions,
    Settings,
)

__all__ = [
    "Controller",
    "ControllerSettings",
    "DirectNlp",
    "InnovationGate",
    "LinearTimeVarying",
    "LtvSettings",
    "NlpSettings",
    "QpOptions",
    "RealTimeIteration",
    "Settings",
]
