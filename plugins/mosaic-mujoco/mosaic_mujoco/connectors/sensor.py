"""`mujoco-sensor`: any sensor of a model by its name, as the standard message that fits it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from mosaic_core import DataChannelConfigurer, DataChannelSendable, Delivery, Message, unit
from mosaic_core.messages import (
    AngularVelocity,
    Imu,
    LinearAcceleration,
    Point,
    Pose,
    Quaternion,
    Range,
    wall_time_us,
)
from mosaic_mujoco.params import PeriodicParams, SensorName
from mosaic_mujoco.world.facts import ModelFacts, SensorFact
from mosaic_mujoco.world.simulation import Simulation

M = TypeVar("M", bound=Message)
MAX_VALUES = 4096
DIGITS = 6

Values = NDArray[np.float64]


class SensorReading(Message):
    """What a sensor measures that no standard message is made for."""

    schema_id: ClassVar[str] = "mosaic-mujoco/SensorReading@1"
    sensor: str = Field(max_length=128, description="Its name in the model.")
    kind: str = Field(max_length=64, description="As the model's file has it: touch, force, jointpos, …")
    values: list[float] = Field(max_length=MAX_VALUES, json_schema_extra=unit(""), description="In the sensor's order.")
    timestamp: int = Field(ge=0, json_schema_extra=unit("µs"), description="Since 1970-01-01 UTC.")
    unit: str = Field(max_length=16, description="Of all values; empty: they have none.")


class MujocoSensorParams(PeriodicParams):
    sensor: SensorName = Field(
        description="A gyro or accelerometer that has the other one at its site is an `Imu`, with the attitude of a "
        "framequat there; a rangefinder a `Range`; a framepos a `Pose`, with the attitude of a framequat; any other a "
        "`SensorReading`."
    )
    range_max_m: float = Field(
        default=10.0, gt=0, description="Of a rangefinder without a cutoff: what is farther away counts as nothing."
    )


class _Sensing(DataChannelSendable[M]):
    """Sends what :meth:`told` makes of the sensors' values."""

    delivery = Delivery.LATEST

    def __init__(
        self, label: str, params: MujocoSensorParams, simulation: Simulation, *sensors: SensorFact | None
    ) -> None:
        super().__init__(label)
        self._period_s = params.period_s
        self._simulation = simulation
        self._sensors = sensors

    def messages(self) -> Iterator[M]:
        for _ in self.every(self._period_s):
            yield self.told(*self._simulation.look(self._read))

    def told(self, *values: Any) -> M:
        """``values``: those of each sensor, ``None`` of one that there is not."""
        raise NotImplementedError

    def _read(self, data: Any) -> list[Values | None]:
        values = data.sensordata
        return [None if one is None else values[one.at : one.at + one.size].copy() for one in self._sensors]


class MujocoImu(_Sensing[Imu]):
    def told(self, *values: Any) -> Imu:
        gyro, acceleration, attitude = values
        return Imu(
            angular_velocity=AngularVelocity(x=gyro[0], y=gyro[1], z=gyro[2]),
            linear_acceleration=LinearAcceleration(x=acceleration[0], y=acceleration[1], z=acceleration[2]),
            orientation=None if attitude is None else quaternion(attitude),
            timestamp=wall_time_us(),
        )


class MujocoRange(_Sensing[Range]):
    def __init__(self, label: str, params: MujocoSensorParams, simulation: Simulation, sensor: SensorFact) -> None:
        super().__init__(label, params, simulation, sensor)
        self._range_max_m = sensor.cutoff or params.range_max_m

    def told(self, *values: Any) -> Range:
        """MuJoCo says -1 where nothing is hit, and the cutoff where it is farther than that."""
        (ranges_m,) = values
        range_m = float(ranges_m[0])
        is_hit = 0 <= range_m < self._range_max_m
        return Range(
            range=range_m if is_hit else None,
            range_max=self._range_max_m,
            radiation="laser",
            timestamp=wall_time_us(),
        )


class MujocoFramePose(_Sensing[Pose]):
    def told(self, *values: Any) -> Pose:
        position, attitude = values
        return Pose(
            position=Point(x=position[0], y=position[1], z=position[2]),
            orientation=Quaternion() if attitude is None else quaternion(attitude),
            timestamp=wall_time_us(),
        )


class MujocoReading(_Sensing[SensorReading]):
    def told(self, *values: Any) -> SensorReading:
        (found,), (sensor,) = values, self._sensors
        assert sensor is not None
        return SensorReading(
            sensor=sensor.name[:128],
            kind=sensor.kind[:64],
            unit=sensor.unit,
            values=np.round(found[:MAX_VALUES], DIGITS).tolist(),
            timestamp=wall_time_us(),
        )


def quaternion(wxyz: Any) -> Quaternion:
    """MuJoCo's order is w, x, y, z. Before the first step it may be all zeros."""
    length = float(np.linalg.norm(wxyz))
    w, x, y, z = (wxyz / length).tolist() if length > 0 else (1.0, 0.0, 0.0, 0.0)
    return Quaternion(x=x, y=y, z=z, w=w)


class MujocoSensorConfigurer(DataChannelConfigurer[MujocoSensorParams]):
    """Sensor of a MuJoCo model: IMU, range, pose, or numbers with their unit."""

    connector_type = "mujoco-sensor"
    example: ClassVar[dict[str, Any] | None] = {"model": "vehicle", "sensor": "imu_gyro"}

    def configure(self) -> DataChannelSendable[Any]:
        simulation = self.params.simulation(self.shared).simulation
        sensor = simulation.facts.sensor(self.params.sensor)
        gyro, acceleration = imu_of(simulation.facts, sensor)
        if gyro is not None and acceleration is not None:
            attitude = attitude_at(simulation.facts, sensor)
            return MujocoImu(self.label, self.params, simulation, gyro, acceleration, attitude)
        if sensor.kind == "rangefinder" and sensor.size == 1:
            return MujocoRange(self.label, self.params, simulation, sensor)
        if sensor.kind == "framepos":
            attitude = simulation.facts.beside(sensor, "framequat")
            return MujocoFramePose(self.label, self.params, simulation, sensor, attitude)
        return MujocoReading(self.label, self.params, simulation, sensor)


def imu_of(facts: ModelFacts, sensor: SensorFact) -> tuple[SensorFact | None, SensorFact | None]:
    """The gyro and the accelerometer that make an IMU with this sensor, as far as there are any."""
    if sensor.kind == "gyro":
        return sensor, facts.beside(sensor, "accelerometer")
    if sensor.kind == "accelerometer":
        return facts.beside(sensor, "gyro"), sensor
    return None, None


def attitude_at(facts: ModelFacts, sensor: SensorFact) -> SensorFact | None:
    """The framequat in the world's frame of the same site."""
    return facts.beside(sensor, "framequat")
