"""A passenger car on a sine path in gusty wind: the controller plans with a bicycle, the plant has four wheels."""

import numpy as np

import rumo
from rumo.references import SinePath
from rumo.simulation import Constant, Gust, Sensors
from rumo.vehicles import PASSENGER_CAR, dynamic_bicycle, four_wheel, friction_circles

path = SinePath(amplitude=2.0, wavelength=80.0, speed=15.0, vehicle=PASSENGER_CAR)
problem = rumo.Problem(
    dynamic_bicycle(PASSENGER_CAR),
    horizon=20,
    sampling_time=0.05,
    delay=1,
    track={
        "p_x": rumo.Weight(10.0, range=50.0),
        "p_y": rumo.Weight(10.0, range=4.0),
        "psi": rumo.Weight(1.0, range=0.6),
        "v_x": rumo.Weight(1.0, range=10.0),
    },
    moves={"torque": rumo.Weight(0.1, range=2000.0), "steering_rate": rumo.Weight(0.1, range=0.8)},
    bounds={"torque": (-1000.0, 1000.0), "steering_rate": (-0.4, 0.4)},
    constraints=friction_circles(PASSENGER_CAR, rumo.Penalty(1.0)),
)
rolling = 15.0 / PASSENGER_CAR.r
start = dict.fromkeys(four_wheel(PASSENGER_CAR).states, 0.0)
start |= {"v_x": 15.0, "w_fl": rolling, "w_fr": rolling, "w_rl": rolling, "w_rr": rolling}

log = rumo.simulate(
    rumo.RealTimeIteration(problem),
    plant=four_wheel(PASSENGER_CAR, load_transfer=True),
    x=start,
    reference=path,
    duration=20.0,
    seed=1,
    sensors=Sensors({"p_x": 0.02, "p_y": 0.02, "psi": 0.005, "v_y": 0.02, "omega": 0.01}),
    disturbances={"wind_speed": Gust(mean=3.0, peak=25.0, start=8.0, duration=4.0), "wind_direction": Constant(1.57)},
)
p_y = log.plant.sel(plant_state="p_y") - log.reference.sel(output="p_y")
print(f"largest lateral error after 2 s: {float(np.abs(p_y[40:]).max()):.3f} m")
print("statuses:", dict(zip(*np.unique(log.status, return_counts=True), strict=True)))
rumo.show(log).savefig("car_in_wind.png")
