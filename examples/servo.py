"""A position servo: the current settles in 0.1 ms, the controller samples every 10 ms."""

import numpy as np

import rumo

motor = rumo.Model(
    states={"angle": "rad", "speed": "rad/s", "current": "A"},
    inputs={"voltage": "V"},
    parameters={"resistance": rumo.Parameter("ohm", 1.0), "inductance": rumo.Parameter("H", 1e-4)},
    dynamics=lambda x, u, p: {
        "angle": x.speed,
        "speed": (0.05 * x.current - 1e-4 * x.speed) / 1e-3,
        "current": (u.voltage - p.resistance * x.current - 0.05 * x.speed) / p.inductance,
    },
)
problem = rumo.Problem(
    motor,
    horizon=30,
    sampling_time=0.01,
    delay=1,
    track={"angle": rumo.Weight(1.0, range=3.2)},
    moves={"voltage": rumo.Weight(0.01, range=48.0)},
    bounds={"voltage": (-24.0, 24.0), "current": rumo.Bounds(-6.0, 6.0, penalty=rumo.Penalty(1.0))},
)
controller = rumo.RealTimeIteration(problem)

plan = controller.step(x=[0.0, 0.0, 0.0], reference={"angle": 3.14})
print(plan.status.name, "first voltages:", plan.u["voltage"][:4].round(2), "V")

log = rumo.simulate(controller, plant=motor, x=[0.0, 0.0, 0.0], reference={"angle": 3.14}, duration=1.0)
angle, current = log.plant.sel(plant_state="angle"), log.plant.sel(plant_state="current")
print(f"angle after 1 s: {float(angle[-1]):.4f} rad, largest current: {float(np.abs(current).max()):.2f} A")
