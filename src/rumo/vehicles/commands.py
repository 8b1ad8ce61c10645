"""What a car is told: inputs of a model, and the torque that each wheel gets and the angle that it steers by."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

from rumo.errors import ArgumentError
from rumo.vehicles.drivetrain import axle_torques
from rumo.vehicles.parameters import VehicleParameters


class Drive(Protocol):
    """How a car is told to accelerate and to brake."""

    def inputs(self, wheels: tuple[str, ...]) -> dict[str, str]:
        """Units of the inputs, by name, of a model with these wheels: their names begin with f or r."""
        ...

    def torques(self, x: Any, u: Any, wheels: tuple[str, ...], parameters: VehicleParameters) -> dict[str, Any]:
        """Torque on each wheel [N m], as if none could lock."""
        ...


class Steering(Protocol):
    """How a car is told to steer."""

    inputs: ClassVar[dict[str, str]]
    states: ClassVar[dict[str, str]]

    def angle(self, x: Any, u: Any) -> Any:
        """Steering angle of the front axle [rad]."""
        ...

    def rates(self, u: Any) -> dict[str, Any]:
        """Derivatives of the states."""
        ...


@dataclass(frozen=True)
class RearTorque:
    """`torque` on each rear wheel [N m], the paper's input; drive and brakes of the car share twice as much out.

    Parameters
    ----------
    axle : bool
        `torque` is that of the axle, shared by its wheels.
    """

    axle: bool = False

    def inputs(self, wheels: tuple[str, ...]) -> dict[str, str]:
        """See `Drive`."""
        return {"torque": "N m"}

    def torques(self, x: Any, u: Any, wheels: tuple[str, ...], parameters: VehicleParameters) -> dict[str, Any]:
        """See `Drive`."""
        return _shared(x, (1.0 if self.axle else 2.0) * u.torque, wheels, parameters)


@dataclass(frozen=True)
class Acceleration:
    """`acceleration` [m/s^2], what most vehicles' interfaces take: the torque that gives it on a flat road."""

    def inputs(self, wheels: tuple[str, ...]) -> dict[str, str]:
        """See `Drive`."""
        return {"acceleration": "m/s^2"}

    def torques(self, x: Any, u: Any, wheels: tuple[str, ...], parameters: VehicleParameters) -> dict[str, Any]:
        """See `Drive`."""
        return _shared(x, parameters.m * parameters.r * u.acceleration, wheels, parameters)


@dataclass(frozen=True)
class AxleTorques:
    """`torque_front` and `torque_rear`, of the axles [N m]."""

    def inputs(self, wheels: tuple[str, ...]) -> dict[str, str]:
        """See `Drive`."""
        return {"torque_front": "N m", "torque_rear": "N m"}

    def torques(self, x: Any, u: Any, wheels: tuple[str, ...], parameters: VehicleParameters) -> dict[str, Any]:
        """See `Drive`."""
        return {wheel: 0.5 * (u.torque_front if wheel[0] == "f" else u.torque_rear) for wheel in wheels}


@dataclass(frozen=True)
class WheelTorques:
    """A torque for each wheel [N m], such as `torque_fl`; `torque_f` and `torque_r` where a wheel stands for two."""

    def inputs(self, wheels: tuple[str, ...]) -> dict[str, str]:
        """See `Drive`."""
        return {f"torque_{wheel}": "N m" for wheel in wheels}

    def torques(self, x: Any, u: Any, wheels: tuple[str, ...], parameters: VehicleParameters) -> dict[str, Any]:
        """See `Drive`."""
        return {wheel: u[f"torque_{wheel}"] for wheel in wheels}


def _shared(x: Any, torque: Any, wheels: tuple[str, ...], parameters: VehicleParameters) -> dict[str, Any]:
    """Half of its axle's torque for each wheel."""
    front, rear = axle_torques(torque, x.v_x, parameters)
    return {wheel: 0.5 * (front if wheel[0] == "f" else rear) for wheel in wheels}


@dataclass(frozen=True)
class SteeringRate:
    """`steering_rate` [rad/s], of which the steering angle `delta` is the integral."""

    inputs: ClassVar[dict[str, str]] = {"steering_rate": "rad/s"}
    states: ClassVar[dict[str, str]] = {"delta": "rad"}

    def angle(self, x: Any, u: Any) -> Any:
        """See `Steering`."""
        return x.delta

    def rates(self, u: Any) -> dict[str, Any]:
        """See `Steering`."""
        return {"delta": u.steering_rate}


@dataclass(frozen=True)
class SteeringAngle:
    """`steering_angle` [rad], taken at once; `with_actuators` makes it lag."""

    inputs: ClassVar[dict[str, str]] = {"steering_angle": "rad"}
    states: ClassVar[dict[str, str]] = {}

    def angle(self, x: Any, u: Any) -> Any:
        """See `Steering`."""
        return u.steering_angle

    def rates(self, u: Any) -> dict[str, Any]:
        """See `Steering`."""
        return {}


REAR_TORQUE, STEERING_RATE = RearTorque(), SteeringRate()


def check_commands(drive: object, steering: object) -> None:
    """Raise for what is no `Drive` or no `Steering`."""
    examples = ("rumo.vehicles.Acceleration()", "rumo.vehicles.SteeringAngle()")
    methods = (("inputs", "torques"), ("angle", "rates"))
    for argument, value, needed, example in zip(
        ("drive", "steering"), (drive, steering), methods, examples, strict=True
    ):
        if isinstance(value, type) or not all(hasattr(value, name) for name in needed):
            raise ArgumentError(argument, repr(value), f"inputs such as {example}")
