"""Made-up rows of a campaign: what its report has to cope with."""

import numpy as np
import pandas as pd

CLOSE, SAFE = "kpi.tracking_error_max_after_2s_m", "kpi.fallbacks"


def made_up(draws=200, controllers=("rti", "ltv"), seed=0, failures=True):
    """A row for each draw and controller: errors grow with speed and with less friction, now and then a run fails."""
    random = np.random.default_rng(seed)
    speed = random.choice([6.0, 8.0, 10.0], draws)
    mu, mass = random.uniform(0.7, 1.1, draws), random.normal(1093.3, 60.0, draws)
    noise, common = np.exp(random.uniform(np.log(0.01), np.log(0.2), draws)), random.normal(0.0, 0.2, draws)
    parts = []
    for i, name in enumerate(controllers):
        level = np.log(0.12 + 0.004 * i) + 0.15 * (speed - 8.0) - 1.2 * (mu - 0.9)
        error = np.exp(level + common + random.normal(0.0, 0.08, draws))
        lost = random.random(draws) < 0.015 * (speed == 10.0)
        outcome = np.full(draws, "done", dtype=object)
        text = np.full(draws, None, dtype=object)
        if failures:
            for kind, words in (
                ("raised", "PlantError: the plant could not be integrated at t = %.2f s"),
                ("crashed", "signal 11 (SIGSEGV)"),
                ("timeout", "not done after 60 s"),
            ):
                for k in np.flatnonzero(random.random(draws) < 0.006):
                    outcome[k], text[k] = kind, words % random.uniform(1, 9) if "%" in words else words
        done = outcome == "done"
        ended = np.full(draws, None, dtype=object)
        for k in np.flatnonzero(lost & done):
            ended[k] = (
                f"Lost at s = {random.integers(90)} m, after {random.uniform(1, 20):.2f} s: the car stands still."
            )
        figures = {
            "kpi.tracking_error_rms_after_2s_m": 0.4 * error,
            CLOSE: np.where(lost, error * 300.0, error),
            SAFE: np.where(lost, 120.0, random.poisson(0.02, draws)),
            "kpi.lap_time_s": np.full(draws, np.nan),
            "kpi.distance_m": speed * 24.0 - error,
            "kpi.input_variation_per_s.torque": 40.0 + 300.0 * noise + random.normal(0, 3, draws),
            "kpi.input_variation_per_s.steering_rate": 2.0 * noise,
        }
        parts.append(
            pd.DataFrame(
                {
                    "key": [f"{k:08x}{i:08x}" for k in range(draws)],
                    "draw": np.arange(draws),
                    "controller": name,
                    "outcome": outcome,
                    "error": text,
                    "attempts": np.where(outcome == "crashed", 2, 1),
                    "setting.seed": np.arange(draws) % 50,
                    "setting.speed": speed,
                    "setting.mass": mass,
                    "setting.plant.mu": mu,
                    "setting.sensors.noise.p_x": noise,
                    **{column: np.where(done, values, np.nan) for column, values in figures.items()},
                    "status.OPTIMAL": np.where(done, 600.0, np.nan),
                    "ended": ended,
                    "run.wall_time_s": random.uniform(0.1, 0.2, draws),
                    "run.step_time_p50_us": np.where(done, random.uniform(16, 20, draws) * (1 + 50 * i), np.nan),
                    "run.step_time_p99_us": np.where(done, random.uniform(30, 40, draws) * (1 + 50 * i), np.nan),
                    "run.step_time_max_us": np.where(done, random.uniform(60, 400, draws) * (1 + 50 * i), np.nan),
                    "run.deadline_misses": np.where(done, 0.0, np.nan),
                    "run.host": "laptop",
                    "run.started": "2026-11-28T12:00:00+00:00",
                    "run.rumo": "0.1.0",
                    "run.python": "3.12.3",
                    "run.casadi": "3.7.2",
                    "run.numpy": "2.3.1",
                    "run.backend": "tailored",
                }
            )
        )
    return pd.concat(parts, ignore_index=True)
