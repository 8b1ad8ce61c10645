"""The figures of a drive."""

from __future__ import annotations

import numpy as np

from rumo.references.car_limits import accelerations
from rumo.report.charts import LIMIT, Chart, Colored, Line, Look, Panels
from rumo.signals import Array
from rumo.simulation.log import names, signal
from rumo.studies.drive.roads import DrivenRoad
from rumo.studies.kpis import Driven
from rumo.vehicles import VehicleParameters

CAR = Look("#0072B2", "solid", 1.2)
POINTS = Look("#0072B2", "", 0.0, "circle", 2.0)
EDGE = Look("#444444", "solid", 0.7)
CONES = Look("#D55E00", "", 0.0, "triangle-up", 2.8)
PROFILE = Look("#E69F00", "dash", 1.4)
WIDTH, LOWEST, HIGHEST = 5.6, 1.3, 7.0
"""Of the axes of a path in print, and the heights that they may have [inch]."""
ALONG = "Distance along the path [m]"
WHEELS = {
    "fl": "front left",
    "fr": "front right",
    "rl": "rear left",
    "rr": "rear right",
    "f": "front axle",
    "r": "rear axle",
}
TITLES = {
    "torque": "Torque on each rear wheel",
    "acceleration": "Acceleration asked for",
    "steering_rate": "Steering rate",
    "steering_angle": "Steering angle",
    "delta": "Steering angle",
}
NEAR = 2.0
"""A limit that is farther away than so many times the largest value is left out: it would flatten the curve."""


def drive_charts(drive: Driven, road: DrivenRoad, grip: float, mu: float | None) -> list[Chart | Panels]:
    """All figures that a drive gives."""
    speed = drive.motion("v_x", "v_y")
    car = drive.car
    found = [
        *([] if speed is None else [path_chart(drive, np.hypot(*speed), road.cones)]),
        *([] if drive.acceleration is None or car is None else [gg_chart(drive.acceleration, car, grip, mu)]),
        *([friction_panels(drive)] if drive.friction_use else []),
        deviation_panels(drive),
        input_panels(drive),
        step_chart(drive),
    ]
    return found


def path_chart(drive: Driven, speed: Array, cones: Array | None = None) -> Chart:
    """Where the car went, in the colours of its speed, between the edges of the track."""
    place = drive.motion("p_x", "p_y")
    x, y = (np.empty(0), np.empty(0)) if place is None else place
    lines: list[Line] = []
    if drive.track is not None:
        path = drive.track.path
        s = np.linspace(0.0, path.length, max(200, round(path.length)))
        left, right = drive.track.edges(s)
        both = np.vstack([left, np.full((1, 2), np.nan), right])
        lines.append(Line("Edges of the track", both[:, 0], both[:, 1], EDGE))
    if cones is not None:
        lines.append(Line("Cones", cones[:, 0], cones[:, 1], CONES))
    lines.append(Line("Start", x[:1], y[:1], Look("#000000", "", 0.0, "x", 6.0)))
    every = [*(np.column_stack([line.x, line.y]) for line in lines), np.column_stack([x, y])]
    spans = np.nanmax(np.vstack(every), axis=0) - np.nanmin(np.vstack(every), axis=0)
    height = 1.0 + float(np.clip(WIDTH * spans[1] / max(spans[0], 1e-9), LOWEST, HIGHEST))
    return Chart(
        "path",
        "Path driven, coloured by speed",
        "x [m]",
        "y [m]",
        tuple(lines),
        colored=Colored(x, y, speed, "Speed [m/s]"),
        equal=True,
        height=height,
    )


def gg_chart(acceleration: tuple[Array, Array], car: VehicleParameters, grip: float, mu: float | None) -> Chart:
    """Accelerations, and what the tyres and the speed profile allow."""
    along, across = acceleration
    limits = ((1.0, "Limit of the tyres", LIMIT), (grip, f"Limit of the profile, grip {grip:g}", PROFILE))
    lines = [Line("Car", across, along, POINTS)]
    for share, name, look in limits:
        at = accelerations(car, share, car.mu if mu is None else mu)
        half = np.r_[at.lateral, at.lateral[::-1]], np.r_[at.driving, -at.braking[::-1]]
        x, y = np.r_[half[0], -half[0][::-1]], np.r_[half[1], half[1][::-1]]
        lines.append(Line(name, x, y, look))
    return Chart(
        "g-g",
        "Accelerations of the centre of gravity",
        "Lateral, to the left [m/s^2]",
        "Longitudinal [m/s^2]",
        tuple(lines),
        equal=True,
        height=5.2,
    )


def friction_panels(drive: Driven) -> Panels:
    """How much of its friction each tyre uses, along the path."""
    s = _along(drive)
    limit = Line("mu F_z", _ends(s), np.ones(2), LIMIT)
    panels = tuple(
        (WHEELS.get(wheel, wheel).capitalize(), (Line("Tyre", s, used, CAR), limit))
        for wheel, used in drive.friction_use.items()
    )
    return Panels("friction-use", "Friction used by each tyre", ALONG, "Force over mu F_z [1]", panels, height=1.6)


def deviation_panels(drive: Driven) -> Panels:
    """How far the car was from its path and from the profile's speed."""
    s, found = _along(drive), drive.deviations
    panels: list[tuple[str, tuple[Line, ...]]] = [
        (title, (Line("Car", s, values, CAR),))
        for title, values in (
            ("Lateral deviation [m], positive to the left", found.get("lateral_deviation")),
            ("Yaw deviation [rad]", found.get("yaw_deviation")),
        )
        if values is not None
    ]
    speed = drive.motion("v_x", "v_y")
    if speed is not None:
        lines = [Line("Car", s, np.hypot(*speed), CAR)]
        if drive.profile is not None:
            lines.append(Line("Speed profile", s, drive.profile.speed_at(s), PROFILE))
        panels.append(("Speed [m/s]", tuple(lines)))
    title = "Deviations from the path, and speed"
    return Panels("deviations", title, ALONG, "", tuple(panels), shared="x", height=1.55, across=1)


def input_panels(drive: Driven) -> Panels:
    """What the car was told, and the steering angle, between their limits."""
    s, log = _along(drive), drive.log
    wanted = [("input", "applied", name) for name in names(log, "input")]
    if "delta" in names(log, "state"):
        wanted.append(("state", "true_states", "delta"))
    panels: list[tuple[str, tuple[Line, ...]]] = []
    for dim, variable, name in wanted:
        values = signal(log, variable, name)
        unit = str(log[f"{dim}_unit"].sel({dim: name}).item())
        lines = [Line("Car", s, values, CAR, steps=dim == "input")]
        reach = NEAR * float(np.nanmax(np.abs(values), initial=0.0))
        bounds = [log[f"{dim}_{side}"].sel({dim: name}).to_numpy() for side in ("lower", "upper")]
        near = [bound for bound in bounds if np.isfinite(bound).all() and np.abs(bound).max() <= reach]
        if near:
            gap = np.full(1, np.nan)
            x, y = (
                np.concatenate([part for each in near for part in (of(each), gap)]) for of in (lambda _: s, np.array)
            )
            lines.append(Line("Limit", x, y, LIMIT))
        panels.append((f"{TITLES.get(name, name)} [{unit}]", tuple(lines)))
    return Panels("inputs", "Inputs", ALONG, "", tuple(panels), shared="x", height=1.55, across=1)


def step_chart(drive: Driven) -> Chart:
    """How long steps took, the time that 99 % of them do not exceed, and the time that there was."""
    times = drive.log["step_time"].to_numpy()
    times = 1e3 * times[np.isfinite(times)]
    p99, deadline = float(np.percentile(times, 99.0)), 1e3 * drive.sampling_time
    return Chart(
        "step-time",
        "Execution time of a step",
        "Time [ms]",
        "Steps",
        histogram=Line(f"Steps, median {np.median(times):.3g} ms", times, times, CAR),
        markers=((p99, f"99 %, {p99:.3g} ms"), (deadline, f"Sampling period, {deadline:g} ms")),
    )


def _along(drive: Driven) -> Array:
    """Distance along the path at the samples (K,) [m]."""
    return drive.deviations["progress"]


def _ends(s: Array) -> Array:
    return np.array([np.nanmin(s), np.nanmax(s)])
