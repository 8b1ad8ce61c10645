"""Discretisation schemes by name, explicit ones with as many substeps as a drive asks for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from rumo.checks import whole_number
from rumo.discretization import Discretization
from rumo.discretization.stability import eigenvalues, stable_substeps
from rumo.errors import ArgumentError, UnknownNameError
from rumo.registry import DISCRETIZATIONS
from rumo.simulation.replay import Recording


def schemes_of(names: Sequence[str], recording: Recording) -> dict[str, Discretization]:
    """Schemes by NAME or NAME:SUBSTEPS; an explicit one without a number gets the smallest stable one on a drive."""
    schemes: dict[str, Discretization] = {}
    for text in names:
        name, colon, number = text.partition(":")
        if name not in DISCRETIZATIONS:
            raise UnknownNameError("--scheme", name, DISCRETIZATIONS)
        scheme = DISCRETIZATIONS[name]()
        if colon and not number.isdecimal():
            raise ArgumentError("--scheme", repr(text), "NAME or NAME:SUBSTEPS such as rk4:2000")
        if colon:
            scheme = replace(scheme, substeps=whole_number(int(number), f"substeps of {name}", 1))
        elif scheme.explicit:
            scheme = replace(scheme, substeps=stable_substeps(scheme, _products(recording)))
        schemes[name if scheme.substeps == 1 else f"{name}:{scheme.substeps}"] = scheme
    return schemes


def _products(recording: Recording) -> list[complex]:
    """Eigenvalues of the model times the sampling time, at every sample."""
    problem = recording.problem
    rates = eigenvalues(problem.model, recording.x, recording.applied[:, 0], problem.parameters[0])
    return (rates.ravel() * problem.sampling_time).tolist()
