"""Standard manoeuvres: lane changes between cones, steering inputs, circles, stops, parking."""

from rumo.references.manoeuvres.drives import constant_radius, reverse_parking, stop_and_go
from rumo.references.manoeuvres.lane_change import Lane, LaneChange, iso_3888_1, iso_3888_2
from rumo.references.manoeuvres.steering import SineWithDwell, StepSteer

__all__ = [
    "Lane",
    "LaneChange",
    "SineWithDwell",
    "StepSteer",
    "constant_radius",
    "iso_3888_1",
    "iso_3888_2",
    "reverse_parking",
    "stop_and_go",
]
