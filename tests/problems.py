"""Control problems that several tests solve."""

import casadi as ca
import numpy as np

import rumo
from rumo.controllers.engines.guarded import Guarded
from rumo.controllers.engines.numpy import NumpyRti
from rumo.references import SinePath
from rumo.studies import PaperStudy
from rumo.textbook import cart_pendulum, heat_rod, robertson_reactor, van_de_vusse_reactor
from rumo.transcription import Transcription
from rumo.vehicles import PAPER_CAR

EXACT = rumo.QpOptions(tolerance=1e-12)
BACKENDS = ("reference", "riccati", "condensing")
"""The last two: the portable core with either of its solvers."""


def made_with(problem, backend, scheme=None, **settings):
    """A controller with a backend, or with a solver of the portable one; its steps are taken as they come.

    Where steps are cut, the last bits of backends that differ decide how often, and become a part of the result.
    """
    settings = {"trusted_step": np.inf} | settings
    if backend not in BACKENDS[1:]:
        return rumo.RealTimeIteration(problem, scheme, qp=EXACT, backend=backend, **settings)
    qp = rumo.QpOptions(tolerance=1e-12, solver=backend)
    return rumo.RealTimeIteration(problem, scheme, qp=qp, backend="portable", **settings)


def advanced(controller, x, u):
    """The discretised model one step on."""
    return controller.transcription.advance(x, u)[0][: len(x)]


def reference_with(problem, optimize):
    """The reference's plain real-time iteration with a QP solver of one's own."""
    transcription, settings = Transcription(problem), rumo.Settings(trusted_step=np.inf)
    method = NumpyRti(transcription, settings, optimize)
    return rumo.Controller(transcription, Guarded(method, settings, "reference"), settings)


def pendulum(**changes):
    """A torque-limited pendulum: the smallest problem with all parts."""
    model = rumo.Model(
        states={"angle": "rad", "rate": "rad/s"},
        inputs={"torque": "N m"},
        dynamics=lambda x, u, p: {"angle": x.rate, "rate": u.torque - p.gravity * x.angle},
        parameters={"gravity": rumo.Parameter("m/s^2", 9.81)},
        name="pendulum",
    )
    settings = {
        "horizon": 12,
        "sampling_time": 0.05,
        "delay": 1,
        "track": {"angle": rumo.Weight(1.0, range=1.0)},
        "moves": {"torque": rumo.Weight(0.1, range=4.0)},
        "bounds": {"torque": (-2.0, 2.0)},
    }
    return rumo.Problem(**({"model": model} | settings | changes))


def tank(sampling_time=0.5):
    """Hold the level of a tank; its model has no value at negative levels, where an extrapolated guess may well be."""
    model = rumo.Model(
        states={"level": "m"},
        inputs={"flow": "m^3/s"},
        dynamics=lambda x, u, p: {"level": u.flow - ca.sqrt(x.level)},
    )
    return rumo.Problem(
        model,
        horizon=10,
        sampling_time=sampling_time,
        track={"level": rumo.Weight(1.0)},
        moves={"flow": rumo.Weight(0.01)},
        bounds={"flow": (0.0, 2.0)},
    )


def car(speed=8.0, wavelength=60.0, penalty=None, weights=None):
    """The paper's problem with a state beside the reference, and the reference's window."""
    study = PaperStudy(
        path=SinePath(3.0, wavelength, speed, PAPER_CAR), penalty=penalty or rumo.Penalty(1.0), weights=weights
    )
    problem = study.problem()
    window = study.path(0.04 * np.arange(problem.horizon + 1))
    x = {name: float(values[0]) for name, values in window.items()} | {"p_y": 1.0, "v_y": 0.1, "omega": 0.05}
    return problem, [x[name] for name in problem.model.states], window


def swinging_cart():
    """Bring a cart from 1 m aside to the origin with its pendulum upright."""
    model = cart_pendulum()
    problem = rumo.Problem(
        model,
        horizon=25,
        sampling_time=0.04,
        delay=1,
        track={"position": rumo.Weight(1.0), "angle": rumo.Weight(1.0, range=0.5)},
        moves={"force": rumo.Weight(0.1, range=20.0)},
        bounds={"force": (-6.0, 6.0), "speed": rumo.Bounds(-0.8, 0.8, rumo.Penalty(10.0))},
    )
    return problem, [1.0, 0.0, 0.2, 0.0], {"position": 0.0, "angle": 0.0}


def balanced_cart(horizon, **bounds):
    """Hold a pendulum upright on a cart that may go anywhere, but for bounds by name."""
    return rumo.Problem(
        cart_pendulum(),
        horizon=horizon,
        sampling_time=0.05,
        delay=1,
        track={"position": rumo.Weight(1.0), "angle": rumo.Weight(1.0, range=0.5)},
        moves={"force": rumo.Weight(0.1, range=20.0)},
        bounds=bounds,
    )


def stiff_reactor():
    """Move Robertson's reaction, eigenvalues near -3000 1/s, to another conversion within flow limits."""
    model = robertson_reactor()
    problem = rumo.Problem(
        model,
        horizon=20,
        sampling_time=2.0,
        delay=2,
        track={"a": rumo.Weight(1.0, range=0.5)},
        moves={"dilution": rumo.Weight(0.01, range=0.1)},
        bounds={"dilution": (0.0, 0.05), "c": rumo.Bounds(upper=0.17, penalty=rumo.Penalty(0.05))},
        move_bounds={"dilution": (-0.004, 0.004)},
    )
    return problem, [0.8, 2.6e-5, 0.2], {"a": 0.84}


def cooled_reactor():
    """Raise the product of the van de Vusse reactor while its temperature stays below a hard limit."""
    model = van_de_vusse_reactor()
    problem = rumo.Problem(
        model,
        horizon=20,
        sampling_time=36.0,
        delay=0,
        track={"c_b": rumo.Weight(1.0, range=0.2)},
        moves={"flow": rumo.Weight(0.01, range=15.0), "cooling": rumo.Weight(0.01, range=4000.0)},
        bounds={"flow": (3.0, 35.0), "cooling": (-9000.0, 0.0), "temperature": (-np.inf, 114.3)},
        safe_input={"flow": 14.19, "cooling": -1113.5},
    )
    return problem, [2.14, 1.09, 114.2, 112.9], {"c_b": 1.11}


def rod(cells=8, **changes):
    """Heat the middle of a rod from one end."""
    middle = f"t_{cells // 2}"
    settings = {
        "horizon": 20,
        "sampling_time": 20.0,
        "track": {middle: rumo.Weight(1.0, range=50.0)},
        "moves": {"heating": rumo.Weight(0.1, range=1e5)},
        "bounds": {"heating": (0.0, 1e5), "t_1": rumo.Bounds(upper=90.0, penalty=rumo.Penalty(1.0))},
    }
    return rumo.Problem(heat_rod(cells), **(settings | changes))


PROBLEMS = {
    "car": car,
    "swinging_cart": swinging_cart,
    "stiff_reactor": stiff_reactor,
    "cooled_reactor": cooled_reactor,
}
