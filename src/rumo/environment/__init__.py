"""Driving as gymnasium has it, for those who learn to: reset, step, render. Importing it registers `rumo/Drive-v0`."""

from rumo.extras import required

gymnasium = required("gymnasium", "gym", "rumo.environment")

from rumo.environment.club import drive_club  # noqa: E402
from rumo.environment.driving import DrivingEnvironment  # noqa: E402

__all__ = ["DrivingEnvironment", "drive_club"]

# Gymnasium asks no entry points of packages since its version 1: "rumo.environment:rumo/Drive-v0" imports this module.
if "rumo/Drive-v0" not in gymnasium.registry:
    gymnasium.register("rumo/Drive-v0", "rumo.environment.club:drive_club")
