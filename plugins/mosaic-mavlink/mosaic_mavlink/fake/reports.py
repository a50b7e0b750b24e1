"""What a vehicle that is made up tells of itself, message by message. Pure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega as words

from mosaic_mavlink.fake.body import HOME, HOME_ALTITUDE_M, FakeBody
from mosaic_mavlink.link.outgoing import OutgoingMessage

_SENSORS = (
    words.MAV_SYS_STATUS_SENSOR_3D_GYRO | words.MAV_SYS_STATUS_SENSOR_3D_ACCEL | words.MAV_SYS_STATUS_SENSOR_GPS
    | words.MAV_SYS_STATUS_SENSOR_BATTERY
)  # fmt: skip
MakeReport = Callable[["FakeInstruments", int], OutgoingMessage]


@dataclass(slots=True)
class FakeInstruments:
    """The body, and what a test may change."""

    body: FakeBody
    battery_percent: int = 87
    unwell: int = 0
    """Bits of ``MAV_SYS_STATUS_SENSOR`` that are not healthy."""


def _e7(degrees: float) -> int:
    return round(degrees * 1e7)


def _attitude(one: FakeInstruments, boot_ms: int) -> OutgoingMessage:
    angles = {"roll": 0.0, "pitch": 0.0, "yaw": one.body.yaw_rad}
    return "attitude", {
        "time_boot_ms": boot_ms, **angles, "rollspeed": 0.0, "pitchspeed": 0.0, "yawspeed": one.body.yaw_radps,
    }  # fmt: skip


def _local(one: FakeInstruments, boot_ms: int) -> OutgoingMessage:
    body = one.body
    return "local_position_ned", {
        "time_boot_ms": boot_ms, "x": body.north_m, "y": body.east_m, "z": -body.up_m,
        "vx": body.north_mps, "vy": body.east_mps, "vz": -body.up_mps,
    }  # fmt: skip


def _global(one: FakeInstruments, boot_ms: int) -> OutgoingMessage:
    body = one.body
    return "global_position_int", {
        "time_boot_ms": boot_ms, "lat": _e7(body.latitude), "lon": _e7(body.longitude),
        "alt": round((HOME_ALTITUDE_M + body.up_m) * 1000), "relative_alt": round(body.up_m * 1000),
        "vx": round(body.north_mps * 100), "vy": round(body.east_mps * 100), "vz": round(-body.up_mps * 100),
        "hdg": 0xFFFF,
    }  # fmt: skip


def _home(one: FakeInstruments, boot_ms: int) -> OutgoingMessage:
    return "home_position", {
        "latitude": _e7(HOME[0]), "longitude": _e7(HOME[1]), "altitude": round(HOME_ALTITUDE_M * 1000),
        "x": 0.0, "y": 0.0, "z": 0.0, "q": [1.0, 0.0, 0.0, 0.0], "approach_x": 0.0, "approach_y": 0.0,
        "approach_z": 0.0,
    }  # fmt: skip


def _gps(one: FakeInstruments, boot_ms: int) -> OutgoingMessage:
    body = one.body
    return "gps_raw_int", {
        "time_usec": boot_ms * 1000, "fix_type": 3, "lat": _e7(body.latitude), "lon": _e7(body.longitude),
        "alt": round((HOME_ALTITUDE_M + body.up_m) * 1000), "eph": 121, "epv": 200, "vel": 0, "cog": 0xFFFF,
        "satellites_visible": 10, "h_acc": 900,
    }  # fmt: skip


def _scaled_imu(one: FakeInstruments, boot_ms: int) -> OutgoingMessage:
    still = dict.fromkeys(("xacc", "yacc", "xgyro", "ygyro", "xmag", "ymag", "zmag"), 0)
    rate = round(one.body.yaw_radps * 1000)
    return "scaled_imu", {"time_boot_ms": boot_ms, **still, "zacc": -1000, "zgyro": rate}


def _battery(one: FakeInstruments, boot_ms: int) -> OutgoingMessage:
    cells_mv = [4000, 4000, 4000, 4000] + [0xFFFF] * 6
    return "battery_status", {
        "id": 0, "battery_function": 0, "type": 1, "temperature": 2510, "voltages": cells_mv, "current_battery": 1250,
        "current_consumed": 100, "energy_consumed": -1, "battery_remaining": one.battery_percent,
    }  # fmt: skip


def _system(one: FakeInstruments, boot_ms: int) -> OutgoingMessage:
    counts = dict.fromkeys(("drop_rate_comm", "errors_comm", *(f"errors_count{place}" for place in range(1, 5))), 0)
    return "sys_status", {
        "onboard_control_sensors_present": _SENSORS, "onboard_control_sensors_enabled": _SENSORS,
        "onboard_control_sensors_health": _SENSORS & ~one.unwell, "load": 250, "voltage_battery": 16_000,
        "current_battery": 1250, "battery_remaining": one.battery_percent, **counts,
    }  # fmt: skip


def _distance(one: FakeInstruments, boot_ms: int) -> OutgoingMessage:
    return "distance_sensor", {
        "time_boot_ms": boot_ms, "min_distance": 20, "max_distance": 4000,
        "current_distance": min(0xFFFF, round(one.body.up_m * 100) + 25), "type": 0, "id": 0, "orientation": 25,
        "covariance": 0xFF,
    }  # fmt: skip


def _extended(one: FakeInstruments, boot_ms: int) -> OutgoingMessage:
    return "extended_sys_state", {"vtol_state": 0, "landed_state": 2 if one.body.up_m > 0.0 else 1}


REPORTS: Mapping[str, MakeReport] = {
    "ATTITUDE": _attitude, "LOCAL_POSITION_NED": _local, "GLOBAL_POSITION_INT": _global, "HOME_POSITION": _home,
    "GPS_RAW_INT": _gps, "SCALED_IMU": _scaled_imu, "BATTERY_STATUS": _battery, "SYS_STATUS": _system,
    "DISTANCE_SENSOR": _distance, "EXTENDED_SYS_STATE": _extended,
}  # fmt: skip
"""What may be asked for."""
