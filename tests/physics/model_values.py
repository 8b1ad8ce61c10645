"""Numbers out of a model, by name."""

import casadi as ca
import numpy as np


def vectors(model, x, u=None, p=None):
    """States, inputs and parameters as vectors; 0 where a mapping leaves one out."""
    return (
        model.states.vector(x, "x", np.zeros(len(model.states))),
        model.inputs.vector(u or {}, "u", np.zeros(len(model.inputs))),
        model.parameter_vector(p or {}),
    )


def derivative(model, x, u=None, p=None):
    """Time derivative of each state, by name."""
    return dict(zip(model.states, model.f(*vectors(model, x, u, p)).full().ravel(), strict=True))


def jacobian(model, x, u=None, p=None):
    """df/dx, (nx, nx)."""
    slope = ca.Function(
        "slope", [model.x, model.u, model.p], [ca.jacobian(model.f(model.x, model.u, model.p), model.x)]
    )
    return slope(*vectors(model, x, u, p)).full()


def central_differences(model, x, u=None, p=None, step=1e-5):
    """df/dx (nx, nx) by central differences."""
    x, u, p = vectors(model, x, u, p)
    columns = []
    for j in range(len(x)):
        forth, back = x.copy(), x.copy()
        forth[j] += step
        back[j] -= step
        columns.append((model.f(forth, u, p) - model.f(back, u, p)).full().ravel() / (forth[j] - back[j]))
    return np.column_stack(columns)
