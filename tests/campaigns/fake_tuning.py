"""A tuning of drives that are made up."""

from fake_drives import FakeEngine

from rumo.campaigns.tuning.course import carry_out_tuning

RMS, TORQUE = "tracking_error_rms_after_2s_m", "input_variation_per_s.torque"
TEXT = """
[tune]
trials = 24
batch = 4
timeout = 60.0

[scenario]
base = "paper"
duration = 2.4
backend = "portable"

[search]
filter_cutoff = { distribution = "uniform", low = 1.0, high = 9.0 }

[search.problem.weights]
p_y = { distribution = "log-uniform", low = 0.1, high = 50.0 }

[over]
seed = { from = 100, to = 102 }

[objectives]
error = { kpi = "tracking_error_rms_after_2s_m" }

[limits]
torque = { kpi = "input_variation_per_s.torque", times_base = 1.5 }

[check]
vary = { seed = { from = 0, to = 11 } }
scenario = { duration = 3.0 }
"""
BASE = {"filter_cutoff": 3.5, "problem.weights.p_y": 1.0}


def drive(settings):
    """Less error with more weight and a faster filter, and more torque; each seed has its own share of it."""
    settings = BASE | settings
    weight, chance = settings["problem.weights.p_y"], 1.0 + 0.01 * (settings["seed"] % 7)
    error = chance * (0.1 + 0.2 / weight + 0.02 * abs(settings["filter_cutoff"] - 6.0))
    torque = chance * (1.0 + 0.1 * weight)
    return {f"kpi.{RMS}": error, f"kpi.{TORQUE}": torque}


def tuned(tuning, folder, of=drive, most=None):
    engine = FakeEngine(of, most)
    return carry_out_tuning(tuning, folder, engine), engine


def arguments(tuning, **others):
    names = ("recipe", "search", "over", "objectives", "limits", "trials", "batch", "sampler", "timeout", "check")
    return {name: getattr(tuning, name) for name in names} | others
