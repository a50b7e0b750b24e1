"""Converts what sensors measure, both ways. REP-117: an infinity is no return, NaN no measurement."""

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
    Joy,
    LaserScan,
    LinearAcceleration,
    Range,
    Temperature,
)
from mosaic_core.messages.sensors import MAX_AXES, MAX_BUTTONS
from mosaic_ros2.conversion.parts import (
    Origin,
    Ros,
    finite,
    headed,
    quaternion,
    ros_header,
    ros_quaternion,
    ros_vector,
    unknown_as_nan,
)

_CHARGING = {1: True, 2: False, 3: False, 4: False}
_FIXES = {-2: None, -1: "none", 0: "gps", 1: "dgps", 2: "dgps"}
"""sensor_msgs/NavSatStatus; satellite- and ground-based augmentation are both differential."""
_NO_FIX, _FIX = -1, 0
_AUGMENTED = {"dgps": 1, "rtk": 2, "float-rtk": 2}
"""Differential positions come from satellites mostly, those of RTK from the ground."""
_APPROXIMATED = 1
_VERTICAL = 4.0
"""How many times the horizontal variance the vertical one is, as receivers commonly have it."""
_TWO_SIGMA = 2.45
"""A circle that holds 95 % of a normal distribution has this radius, in standard deviations of one axis."""
_RADIATION: tuple[Literal["ultrasound", "infrared"], ...] = ("ultrasound", "infrared")
_RADIATION_NUMBERS = {"ultrasound": 0, "infrared": 1, "laser": 1, None: 255}
"""ROS knows sound and light; what is neither has a number that means nothing."""
_LONGEST_M = 1e6
_SCAN_NUMBERS = ("angle_min", "angle_max", "angle_increment", "time_increment", "scan_time", "range_min")


def scan(message: Ros) -> Iterable[LaserScan]:
    """One turn of a planar scanner."""
    ranges, range_max = message["ranges"], float(message["range_max"])
    intensities = message["intensities"]
    with np.errstate(invalid="ignore"):
        is_return = np.isfinite(ranges) & (ranges >= message["range_min"]) & (ranges <= range_max)
    # Millimetres: what lies below is noise, and would double the text.
    rounded = np.round(ranges.astype(np.float64), 3).tolist()
    yield LaserScan(
        **{name: message[name] for name in _SCAN_NUMBERS},
        range_max=min(range_max, _LONGEST_M),
        ranges=[one if taken else None for one, taken in zip(rounded, is_return.tolist(), strict=True)],
        intensities=np.nan_to_num(intensities).tolist() if len(intensities) == len(ranges) else [],
        **headed(message),
    )


def scan_fields(message: LaserScan, origin: Origin) -> Ros:
    """A ``sensor_msgs/LaserScan``: infinity where nothing came back."""
    return {
        "header": ros_header(origin, message),
        **{name: getattr(message, name) for name in (*_SCAN_NUMBERS, "range_max")},
        "ranges": _floats([math.inf if one is None else one for one in message.ranges]),
        "intensities": _floats(message.intensities),
    }


def _floats(values: list[float]) -> Any:
    """Single precision; what it can't hold becomes an infinity."""
    with np.errstate(over="ignore"):
        return np.array(values, np.float64).astype(np.float32)


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


def distance_fields(message: Range, origin: Origin) -> Ros:
    """A ``sensor_msgs/Range``."""
    return {
        "header": ros_header(origin, message),
        "radiation_type": _RADIATION_NUMBERS.get(message.radiation, _RADIATION_NUMBERS[None]),
        "field_of_view": message.field_of_view or 0.0,
        "min_range": message.range_min,
        "max_range": message.range_max,
        "range": math.inf if message.range is None else message.range,
    }


def stick(message: Ros) -> Iterable[Joy]:
    """How a joystick stands; what more axes and buttons it says than there may be is left out."""
    axes = np.round(np.nan_to_num(message["axes"][:MAX_AXES].astype(np.float64)), 4)
    yield Joy(axes=axes.tolist(), buttons=message["buttons"][:MAX_BUTTONS].tolist(), **headed(message))


def stick_fields(message: Joy, origin: Origin) -> Ros:
    """A ``sensor_msgs/Joy``."""
    return {"header": ros_header(origin, message), "axes": message.axes, "buttons": message.buttons}


def temperature(message: Ros) -> Iterable[Temperature]:
    """A temperature in degrees Celsius."""
    yield Temperature(temperature_c=message["temperature"], timestamp=headed(message)["timestamp"])


def temperature_fields(message: Temperature, origin: Origin) -> Ros:
    """A ``sensor_msgs/Temperature``."""
    return {"header": ros_header(origin, message), "temperature": message.temperature_c}


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


def battery_fields(message: BatteryState, origin: Origin) -> Ros:
    """A ``sensor_msgs/BatteryState``: NaN for what is not measured."""
    status = {True: 1, False: 2, None: 0}[message.charging]
    return {
        "header": ros_header(origin, message),
        "voltage": unknown_as_nan(message.voltage_v),
        "temperature": unknown_as_nan(message.temperature_c),
        "current": math.nan if message.current_a is None else -message.current_a,
        **dict.fromkeys(("charge", "capacity", "design_capacity"), math.nan),
        "percentage": math.nan if message.percent is None else message.percent / 100,
        "power_supply_status": status,
        "present": True,
    }


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


def imu_fields(message: Imu, origin: Origin) -> Ros:
    """A ``sensor_msgs/Imu``: an orientation that nobody estimates has the covariance -1."""
    attitude: dict[str, Any] = {"orientation_covariance": [-1.0, *[0.0] * 8]}
    if message.orientation is not None:
        attitude = {"orientation": ros_quaternion(message.orientation)}
    return {
        "header": ros_header(origin, message),
        **attitude,
        "angular_velocity": ros_vector(message.angular_velocity),
        "linear_acceleration": ros_vector(message.linear_acceleration),
    }


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


def fix_fields(message: GpsFix, origin: Origin) -> Ros:
    """A ``sensor_msgs/NavSatFix``: NaN where no place is known."""
    is_place = message.latitude is not None and message.fix != "none"
    covariance: dict[str, Any] = {}
    if message.accuracy_m is not None:
        variance = (message.accuracy_m / _TWO_SIGMA) ** 2
        diagonal = (variance, variance, _VERTICAL * variance)
        covariance = {
            "position_covariance": np.diag(diagonal).reshape(-1),
            "position_covariance_type": _APPROXIMATED,
        }
    return {
        "header": ros_header(origin, message),
        "status": {"status": _AUGMENTED.get(message.fix or "", _FIX) if is_place else _NO_FIX},
        **{name: unknown_as_nan(getattr(message, name)) for name in ("latitude", "longitude", "altitude")},
        **covariance,
    }
