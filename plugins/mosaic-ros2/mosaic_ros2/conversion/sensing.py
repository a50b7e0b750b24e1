"""Converts what sensors of ROS measure. REP-117: an infinity is no return, NaN no measurement."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, Literal

import numpy as np

from mosaic_core.messages import (
    AngularVelocity,
    BatteryState,
    GpsFix,
    Imu,
    JointState,
    Joy,
    LaserScan,
    LinearAcceleration,
    Range,
    Temperature,
)
from mosaic_core.messages.sensors import MAX_AXES, MAX_BUTTONS
from mosaic_ros2.conversion.parts import Ros, finite, headed, quaternion

_CHARGING = {1: True, 2: False, 3: False, 4: False}
_FIXES = {-2: None, -1: "none", 0: "gps", 1: "dgps", 2: "dgps"}
"""sensor_msgs/NavSatStatus; satellite- and ground-based augmentation are both differential."""
_TWO_SIGMA = 2.45
"""A circle that holds 95 % of a normal distribution has this radius, in standard deviations of one axis."""
_RADIATION: tuple[Literal["ultrasound", "infrared"], ...] = ("ultrasound", "infrared")
_LONGEST_M = 1e6


def scan(message: Ros) -> Iterable[LaserScan]:
    """One turn of a planar scanner."""
    names = ("angle_min", "angle_max", "angle_increment", "time_increment", "scan_time", "range_min")
    ranges, range_max = message["ranges"], float(message["range_max"])
    intensities = message["intensities"]
    with np.errstate(invalid="ignore"):
        is_return = np.isfinite(ranges) & (ranges >= message["range_min"]) & (ranges <= range_max)
    # Millimetres: what lies below is noise, and would double the text.
    rounded = np.round(ranges.astype(np.float64), 3).tolist()
    yield LaserScan(
        **{name: message[name] for name in names},
        range_max=min(range_max, _LONGEST_M),
        ranges=[one if taken else None for one, taken in zip(rounded, is_return.tolist(), strict=True)],
        intensities=np.nan_to_num(intensities).tolist() if len(intensities) == len(ranges) else [],
        **headed(message),
    )


def distance(message: Ros) -> Iterable[Range]:
    """What a single ray or cone measures."""
    cone, radiation = float(message["field_of_view"]), message["radiation_type"]
    yield Range(
        range=finite(message["range"]),
        range_min=message["min_range"],
        range_max=message["max_range"],
        field_of_view=cone if cone > 0 else None,
        radiation=_RADIATION[radiation] if radiation < len(_RADIATION) else None,
        **headed(message),
    )


def stick(message: Ros) -> Iterable[Joy]:
    """How a joystick stands; what more axes and buttons it says than there may be is left out."""
    axes = np.round(np.nan_to_num(message["axes"][:MAX_AXES].astype(np.float64)), 4)
    yield Joy(axes=axes.tolist(), buttons=message["buttons"][:MAX_BUTTONS].tolist(), **headed(message))


def temperature(message: Ros) -> Iterable[Temperature]:
    """A temperature in degrees Celsius."""
    yield Temperature(temperature_c=message["temperature"], timestamp=headed(message)["timestamp"])


def battery(message: Ros) -> Iterable[BatteryState]:
    """Some drivers send per cent where a share of 1 is meant."""
    share, current = finite(message["percentage"]), finite(message["current"])
    percent = None if share is None or share < 0 else min(share * 100 if share <= 1 else share, 100.0)
    yield BatteryState(
        percent=percent,
        voltage_v=finite(message["voltage"]),
        current_a=None if current is None else -current,
        charging=_CHARGING.get(message["power_supply_status"]),
        temperature_c=finite(message["temperature"]),
        timestamp=headed(message)["timestamp"],
    )


def imu(message: Ros) -> Iterable[Imu]:
    """A covariance that begins with -1 says that there is no such measurement."""
    has_orientation = message["orientation_covariance"][0] != -1
    turning, pulling = message["angular_velocity"], message["linear_acceleration"]
    yield Imu(
        angular_velocity=AngularVelocity(**{axis: turning[axis] for axis in "xyz"}),
        linear_acceleration=LinearAcceleration(**{axis: pulling[axis] for axis in "xyz"}),
        orientation=quaternion(message["orientation"]) if has_orientation else None,
        **headed(message),
    )


def joints(message: Ros) -> Iterable[JointState]:
    """A list that has not one finite value for each name is not known."""
    names = message["name"]

    def known(values: Any) -> list[float]:
        return values.tolist() if len(values) == len(names) and np.isfinite(values).all() else []

    yield JointState(
        names=names,
        positions=known(message["position"]),
        velocities=known(message["velocity"]),
        efforts=known(message["effort"]),
        timestamp=headed(message)["timestamp"],
    )


def fix(message: Ros) -> Iterable[GpsFix]:
    """Without a fix there is no place."""
    status, covariance = message["status"]["status"], message["position_covariance"]
    latitude, longitude = finite(message["latitude"]), finite(message["longitude"])
    is_place = status != -1 and latitude is not None and longitude is not None
    spread = float(covariance[0] + covariance[4]) / 2
    is_known = message["position_covariance_type"] > 0 and math.isfinite(spread) and spread >= 0
    yield GpsFix(
        latitude=latitude if is_place else None,
        longitude=longitude if is_place else None,
        altitude=finite(message["altitude"]) if is_place else None,
        fix=_FIXES.get(status),
        accuracy_m=_TWO_SIGMA * math.sqrt(spread) if is_place and is_known else None,
        timestamp=headed(message)["timestamp"],
    )
