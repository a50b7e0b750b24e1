"""An autopilot that is made up: answers as ArduPilot or PX4 would, as far as this plugin asks. Pure: messages and time
go in, messages come out.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as words

from mosaic_mavlink.fake.body import HOME_ALTITUDE_M, FakeBody
from mosaic_mavlink.fake.memory import FakeMission, FakeParameters
from mosaic_mavlink.fake.reports import REPORTS, FakeInstruments
from mosaic_mavlink.link.flight_modes import guided_mode, mode_name, mode_order, stick_modes, vehicle_class
from mosaic_mavlink.link.outgoing import OutgoingMessage

TYPES = {
    "copter": (words.MAV_TYPE_QUADROTOR, words.MAV_AUTOPILOT_ARDUPILOTMEGA, "LOITER"),
    "px4": (words.MAV_TYPE_QUADROTOR, words.MAV_AUTOPILOT_PX4, "POSCTL"),
    "rover": (words.MAV_TYPE_GROUND_ROVER, words.MAV_AUTOPILOT_ARDUPILOTMEGA, "HOLD"),
}
_PERIODS_S = {"HEARTBEAT": 0.25, "SYS_STATUS": 1.0}
"""Real ones beat once a second; so often nobody waits in a trial."""
VELOCITY_TIMEOUT_S = 3.0
"""ArduPilot stands still without a new velocity for so long."""
FORCE = 21196
"""``MAV_CMD_COMPONENT_ARM_DISARM``, param 2: whatever the checks say."""
_RETURNS = {"RTL", "LAND"}
_NO_VELOCITY_TYPE = 0b111000
_ACCEPTED: int = words.MAV_RESULT_ACCEPTED
_DENIED: int = words.MAV_RESULT_DENIED
_FAILED: int = words.MAV_RESULT_FAILED
_UNSUPPORTED: int = words.MAV_RESULT_UNSUPPORTED


class FakeAutopilot:
    """One vehicle. ``kind``: ``copter``, ``px4`` or ``rover``."""

    def __init__(self, kind: str = "copter") -> None:
        self.mav_type, self.autopilot, mode = TYPES[kind]
        self.vehicle_class = vehicle_class(self.autopilot, self.mav_type)
        self.body = FakeBody(flies=kind != "rover")
        self.instruments = FakeInstruments(self.body)
        self.parameters = FakeParameters(bytewise=kind == "px4")
        self.mission = FakeMission()
        self.armed = False
        self.is_ready = True
        """Whether the checks before arming pass."""
        self.firmware = (4, 7)
        self.lacks: set[str] = set()
        """Modes that its firmware does not have."""
        self.custom_mode = 0
        self._enter(mode)
        self.periods_s: dict[str, float] = dict(_PERIODS_S)
        self._due_s: dict[str, float] = {}
        self._moved_s: float | None = None
        self._velocity_s = float("-inf")
        self._texts: list[tuple[int, str]] = [(words.MAV_SEVERITY_INFO, "A vehicle that is made up is ready")]
        self.reboots = 0

    @property
    def mode(self) -> str:
        return mode_name(self.vehicle_class, self.custom_mode)

    def say(self, severity: int, text: str) -> None:
        """Say a text with the next tick."""
        self._texts.append((severity, text))

    def _enter(self, mode: str) -> bool:
        order = mode_order(self.vehicle_class, mode)
        if order is None:
            return False
        is_px4 = self.vehicle_class == "px4"
        self.custom_mode = order.custom << 16 | order.sub << 24 if is_px4 else order.custom
        self.body.stand_still()
        self.body.returns = mode == "RTL"
        self.body.target_up_m = 0.0 if mode == "LAND" else None
        return True

    # -- time --

    def tick(self, now_s: float) -> Iterator[OutgoingMessage]:
        """Move, and tell what is due."""
        if self._moved_s is not None and self.armed:
            self.body.move(now_s - self._moved_s)
        self._moved_s = now_s
        if self.mode == guided_mode(self.vehicle_class) and now_s - self._velocity_s > VELOCITY_TIMEOUT_S:
            self.body.stand_still()
        if self.armed and self.mode in _RETURNS and self.body.up_m == 0.0 and self.body.target_up_m == 0.0:
            self.armed = False
        for kind, period_s in self.periods_s.items():
            if now_s >= self._due_s.get(kind, float("-inf")):
                self._due_s[kind] = now_s + period_s
                yield self._report(kind, now_s)
        for severity, text in self._said():
            yield "statustext", {"severity": severity, "text": text.encode()[:50]}

    def _said(self) -> list[tuple[int, str]]:
        texts, self._texts = self._texts, []
        return texts

    def _report(self, kind: str, now_s: float) -> OutgoingMessage:
        if kind != "HEARTBEAT":
            return REPORTS[kind](self.instruments, int(now_s * 1000) & 0xFFFFFFFF)
        armed = words.MAV_MODE_FLAG_SAFETY_ARMED if self.armed else 0
        return "heartbeat", {
            "type": self.mav_type, "autopilot": self.autopilot, "custom_mode": self.custom_mode,
            "base_mode": words.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | armed,
            "system_status": words.MAV_STATE_ACTIVE if self.armed else words.MAV_STATE_STANDBY,
        }  # fmt: skip

    # -- what it is told --

    def hear(self, message: Any, now_s: float) -> Iterator[OutgoingMessage]:
        """Answer one message of a ground station."""
        kind = message.get_type()
        if kind == "COMMAND_LONG":
            result = self._command(message)
            yield "command_ack", {"command": message.command, "result": result}
            if message.command == words.MAV_CMD_REQUEST_MESSAGE and result == _ACCEPTED:
                yield _version(self.firmware)
        elif kind == "SET_POSITION_TARGET_LOCAL_NED":
            self._velocity(message, now_s)
        elif kind == "MANUAL_CONTROL":
            self._sticks(message)
        elif kind.startswith("PARAM_"):
            yield from self.parameters.hear(message)
        elif kind.startswith("MISSION_"):
            yield from self.mission.hear(message)

    def _command(self, message: Any) -> int:
        match message.command:
            case words.MAV_CMD_SET_MESSAGE_INTERVAL:
                return self._rate(int(message.param1), message.param2)
            case words.MAV_CMD_COMPONENT_ARM_DISARM:
                return self._arm(message.param1 == 1, message.param2 == FORCE)
            case words.MAV_CMD_DO_SET_MODE:
                return self._set_mode(int(message.param2), int(message.param3))
            case words.MAV_CMD_NAV_TAKEOFF:
                return self._take_off(message.param7)
            case words.MAV_CMD_NAV_LAND:
                return _ACCEPTED if self._enter("LAND") else _UNSUPPORTED
            case words.MAV_CMD_NAV_RETURN_TO_LAUNCH:
                return _ACCEPTED if self._enter("RTL") else _UNSUPPORTED
            case words.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN:
                return self._reboot()
            case words.MAV_CMD_REQUEST_MESSAGE if message.param1 == words.MAVLINK_MSG_ID_AUTOPILOT_VERSION:
                return _ACCEPTED
        return _UNSUPPORTED

    def _rate(self, number: int, period_us: float) -> int:
        kind = next((one for one in REPORTS if getattr(words, f"MAVLINK_MSG_ID_{one}") == number), None)
        if kind is None:
            return _UNSUPPORTED
        self.periods_s[kind] = max(0.02, period_us / 1e6)
        return _ACCEPTED

    def _arm(self, wish: bool, forced: bool) -> int:
        if wish and not (self.is_ready or forced):
            self.say(words.MAV_SEVERITY_CRITICAL, "PreArm: GPS 1: Bad fix")
            return _FAILED
        if not wish and self.body.up_m > 0.0 and not forced:
            return _DENIED
        self.armed = wish
        self.body.stand_still()
        return _ACCEPTED

    def _set_mode(self, custom: int, sub: int) -> int:
        number = custom << 16 | sub << 24 if self.vehicle_class == "px4" else custom
        name = mode_name(self.vehicle_class, number)
        return _ACCEPTED if name not in self.lacks and self._enter(name) else _DENIED

    def _take_off(self, altitude_m: float) -> int:
        may = self.armed and self.body.flies and self.mode == guided_mode(self.vehicle_class)
        if self.vehicle_class == "px4" and self.armed:
            may, altitude_m = self._enter("TAKEOFF"), altitude_m - HOME_ALTITUDE_M  # PX4 counts from the sea
        if may:
            self.body.target_up_m = altitude_m
        return _ACCEPTED if may else _FAILED

    def _reboot(self) -> int:
        if self.armed:
            return _DENIED
        self.reboots += 1
        self.periods_s = dict(_PERIODS_S)
        return _ACCEPTED

    def _velocity(self, message: Any, now_s: float) -> None:
        is_velocity = not message.type_mask & _NO_VELOCITY_TYPE
        if self.armed and is_velocity and self.mode == guided_mode(self.vehicle_class):
            self._velocity_s = now_s
            self.body.target_up_m = None
            self.body.forward_mps, self.body.right_mps = message.vx, message.vy
            self.body.up_mps, self.body.yaw_radps = -message.vz, message.yaw_rate

    def _sticks(self, message: Any) -> None:
        if self.armed and self.mode in stick_modes(self.vehicle_class):
            is_rover = self.vehicle_class == "rover"
            self.body.forward_mps = (message.z if is_rover else message.x) / 200
            self.body.right_mps = 0.0 if is_rover else message.y / 200
            self.body.up_mps = 0.0 if is_rover else (message.z - 500) / 250
            self.body.yaw_radps = (message.y if is_rover else message.r) / 1000


def _version(firmware: tuple[int, int]) -> OutgoingMessage:
    zeros = {f"{part}_sw_version": 0 for part in ("middleware", "os")}
    customs = {f"{part}_custom_version": [0] * 8 for part in ("flight", "middleware", "os")}
    return "autopilot_version", {
        "capabilities": 0, "uid": 0, "flight_sw_version": firmware[0] << 24 | firmware[1] << 16, **zeros, **customs,
        "board_version": 0, "vendor_id": 0, "product_id": 0,
    }  # fmt: skip
