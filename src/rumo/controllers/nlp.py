"""The direct NLP: the same discretised problem, solved to convergence by IPOPT."""

from __future__ import annotations

from typing import Any

from rumo.controllers.base import Controller
from rumo.controllers.engines.guarded import Guarded
from rumo.controllers.engines.ipopt import Ipopt
from rumo.controllers.settings import NlpSettings, changed
from rumo.discretization import Discretization
from rumo.problem import Problem
from rumo.transcription import Transcription


class DirectNlp(Controller[NlpSettings]):
    """Nonlinear MPC by direct transcription and IPOPT (Waechter and Biegler, 2006), the paper's baseline.

    Parameters
    ----------
    problem : Problem
        What to solve.
    discretization : Discretization, optional
        The problem's if not given; implicit Euler if it has none.
    settings : NlpSettings
        Limits and accuracy of IPOPT, and the gate.
    **changes
        Single settings by name, such as `max_iterations=50`.
    """

    name = "nlp"
    _method = Ipopt

    def __init__(
        self,
        problem: Problem,
        discretization: Discretization | None = None,
        *,
        settings: NlpSettings = NlpSettings(),
        **changes: Any,
    ) -> None:
        transcription, settings = Transcription(problem, discretization), changed(settings, changes, NlpSettings)
        engine = Guarded(self._method(transcription, settings), settings, "ipopt")
        super().__init__(transcription, engine, settings)
