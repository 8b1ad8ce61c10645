"""Drives of a pendulum that the filter's own model makes, so that all it believes of noise is true."""

import numpy as np

import rumo
from rumo.estimation import ExtendedKalman
from rumo.transcription import Transcription

NOISE = {"angle": 0.02, "rate": 0.1}
PROCESS = {"angle": 0.001, "rate": 0.05}


def pendulum_with_outputs():
    """Angle, rate, and what is seen of them: height, force."""
    model = rumo.Model(
        states={"angle": "rad", "rate": "rad/s"},
        inputs={"torque": "N m"},
        dynamics=lambda x, u, p: {"angle": x.rate, "rate": u.torque - p.gravity * x.angle - p.drag * x.rate},
        parameters={"gravity": rumo.Parameter("m/s^2", 9.81), "drag": rumo.Parameter("1/s", 0.1)},
        outputs={
            "height": rumo.Output("m", lambda x, u, p: x.angle**2),
            "force": rumo.Output("N", lambda x, u, p: u.torque - p.gravity * x.angle),
        },
    )
    return rumo.Problem(
        model,
        horizon=5,
        sampling_time=0.05,
        track={"angle": rumo.Weight(1.0)},
        moves={"torque": rumo.Weight(1.0)},
    )


def drive(problem, samples, seed=0, process=PROCESS, scheme=None, parameters=None):
    """States (K, nx), torques before each sample (K, 1): the discretised model with noise."""
    rng, transcription = np.random.default_rng(seed), Transcription(problem, scheme)
    sigma = np.array([process[name] for name in problem.model.states])
    p = problem.parameters[0] if parameters is None else problem.model.parameter_vector(parameters)
    x, states, torques = np.array([0.4, 0.1]), [], []
    torque = np.zeros(1)
    for k in range(samples):
        states.append(x)
        torques.append(torque)
        torque = np.array([2.0 * np.sin(0.3 * k)])
        x = transcription.advance(x, torque, p)[0][:2] + sigma * rng.normal(size=2)
    return np.array(states), np.array(torques)


def noisy(states, seed=1, noise=NOISE):
    """Measurements of the states."""
    sigma = np.array(list(noise.values()))
    return states + sigma * np.random.default_rng(seed).normal(size=states.shape)


def estimates(problem, samples, torques, measured=None, scheme=None, **settings):
    """What a filter makes of measurements (K, m): its estimates, and the filter."""
    settings = {"noise": NOISE, "process": PROCESS} | settings
    running = ExtendedKalman(**settings).start(problem, measured, scheme)
    told = [running.update(y, u, problem.parameters[0]) for y, u in zip(samples, torques, strict=True)]
    return told, running
