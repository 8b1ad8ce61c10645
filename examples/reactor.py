"""A cooled reactor: change the product's concentration, keep the temperature below its limit; RTI beside IPOPT."""

import numpy as np

import rumo
from rumo.textbook import van_de_vusse_reactor

reactor = van_de_vusse_reactor()
problem = rumo.Problem(
    reactor,
    horizon=30,
    sampling_time=36.0,
    track={"c_b": rumo.Weight(1.0, range=0.2), "temperature": rumo.Weight(0.1, range=20.0)},
    moves={"flow": rumo.Weight(0.01, range=15.0), "cooling": rumo.Weight(0.01, range=4000.0)},
    bounds={
        "flow": (3.0, 35.0),
        "cooling": (-9000.0, 0.0),
        "temperature": rumo.Bounds(upper=114.5, penalty=rumo.Penalty(1.0)),
    },
    safe_input={"flow": 14.19, "cooling": -1113.5},
)
start = {"c_a": 2.14, "c_b": 1.09, "temperature": 114.2, "jacket": 112.9}


def target(t):
    """Less product from 6 minutes on, more again from 30."""
    product = np.where(t < 360.0, 1.05, np.where(t < 1800.0, 0.9, 1.0))
    return {"c_b": product, "temperature": np.full(len(t), 114.0)}


for make in (rumo.RealTimeIteration, rumo.DirectNlp):
    log = rumo.simulate(make(problem), plant=reactor, x=start, reference=target, duration=3600.0)
    product, temperature = log.plant.sel(plant_state="c_b"), log.plant.sel(plant_state="temperature")
    error = product - log.reference.sel(output="c_b")
    print(
        f"{log.attrs['controller']}: RMS error {float(np.sqrt((error**2).mean())):.4f} mol/l, "
        f"largest temperature {float(temperature.max()):.2f} degC, "
        f"median step {1e3 * float(log.step_time.median()):.2f} ms"
    )
