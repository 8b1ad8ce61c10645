"""A car on a track: the drive behind `rumo drive`, and what other drives are made of."""

from rumo.studies.drive.estimators import ESTIMATORS, estimator_of, noise_of
from rumo.studies.drive.plants import PLANTS, DrivenCar, driven_car
from rumo.studies.drive.roads import ROADS, DrivenRoad, driven_road
from rumo.studies.drive.run import DriveRun
from rumo.studies.drive.setting import DriveSetting
from rumo.studies.drive.steady_bend import SteadyBend, steady_bend
from rumo.studies.drive.study import Drive

__all__ = [
    "ESTIMATORS",
    "PLANTS",
    "ROADS",
    "Drive",
    "DriveRun",
    "DriveSetting",
    "DrivenCar",
    "DrivenRoad",
    "SteadyBend",
    "driven_car",
    "driven_road",
    "estimator_of",
    "noise_of",
    "steady_bend",
]
