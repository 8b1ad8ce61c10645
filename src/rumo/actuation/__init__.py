"""What lies between a command and its effect: computation, dead time, lag, limits of rate."""

from rumo.actuation.actuator import Actuation, Actuator
from rumo.actuation.prediction import behind_actuators, with_actuators
from rumo.actuation.timing import ActingInputs, acting_inputs

__all__ = ["ActingInputs", "Actuation", "Actuator", "acting_inputs", "behind_actuators", "with_actuators"]
