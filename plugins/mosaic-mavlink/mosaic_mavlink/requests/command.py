"""The ``mavlink-command`` connector: arm, disarm, modes, take off, land, reboot."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator
from pymavlink.dialects.v20 import ardupilotmega as words

from mosaic_core.contract.handler import Refused
from mosaic_core.contract.params import Message
from mosaic_core.contract.request_handler import Request, RequestHandler
from mosaic_core.words.errors import hint_at
from mosaic_mavlink.control.velocity import STILL
from mosaic_mavlink.link.contact import VehicleContact
from mosaic_mavlink.link.flight_modes import action_mode, guided_mode, mode_order, modes_of
from mosaic_mavlink.link.vehicle import VehicleFacts
from mosaic_mavlink.link.vehicle_configurer import VehicleConfigurer
from mosaic_mavlink.params import VehicleParams
from mosaic_mavlink.requests.command_words import CommandConversation
from mosaic_mavlink.requests.converse import conversed

_log = logging.getLogger(__name__)

FORCE = 21196
"""``MAV_CMD_COMPONENT_ARM_DISARM``, param 2: whatever its checks say, and in flight too."""
OFFBOARD_BEFORE_S = 0.6
OFFBOARD_FOR_S = 30.0
"""PX4 enters OFFBOARD only while it is told velocities; until an operator's own, it is told to stand still."""
BELIEVED_AFTER_S = 3.0
LOOK_S = 0.02
NO_NUMBER = math.nan
VehicleAction = Literal["hold", "land", "rtl", "mode", "arm", "disarm", "takeoff", "reboot"]
"""The first is what a form offers: it must harm nobody."""


class VehicleCommand(Message):
    """What a vehicle shall do."""

    action: VehicleAction
    mode: str = Field(default="", max_length=32, description="For `mode`: its name, such as GUIDED.")
    altitude_m: float = Field(default=0.0, ge=0, le=500, description="For `takeoff`: above the ground.")
    forced: bool = Field(
        default=False, description="For `arm` and `disarm`: against the vehicle's own checks. In flight it falls."
    )
    reason: str = Field(default="", max_length=200, description="Why it is forced; goes into the robot's log.")

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        if self.action == "mode" and not self.mode:
            raise ValueError("the action mode needs a mode, such as GUIDED")
        if self.action == "takeoff" and self.altitude_m == 0.0:
            raise ValueError("the action takeoff needs an altitude_m above 0")
        if self.forced and (self.action not in ("arm", "disarm") or len(self.reason.strip()) < 3):
            raise ValueError("only arm and disarm can be forced, and only with a reason")
        return self


class CommandDone(Message):
    """The vehicle accepted it."""

    did: str
    said: list[str] = Field(default=[], description="Warnings of the vehicle meanwhile.")


class MavlinkCommand(RequestHandler[VehicleCommand, CommandDone]):
    """Asks a vehicle to do something, one thing at a time. The vehicle decides, and says why not."""

    requires_lease = True
    at_once: ClassVar[int] = 1
    answer_within_s: ClassVar[float] = 60.0

    def __init__(self, label: str, contact: VehicleContact) -> None:
        super().__init__(label)
        self._contact = contact

    def answer(self, question: VehicleCommand, request: Request) -> CommandDone:
        """On the handler's own thread."""
        facts = self._contact.facts()
        match question.action:
            case "arm" | "disarm":
                return self._arm(question, request)
            case "takeoff":
                return self._take_off(question.altitude_m, facts, request)
            case "reboot":
                numbers = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
                return self._do("reboot", words.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, numbers, request)
            case "mode":
                return self._enter(question.mode.upper(), facts, request)
            case action:
                mode = action_mode(facts.kind, action)
                if mode is None:
                    raise Refused("mavlink.no_such_action", f"a {facts.kind} knows no {action}")
                return self._enter(mode, facts, request)

    def _do(self, what: str, command: int, params: tuple[float, ...], request: Request) -> CommandDone:
        said = conversed(self._contact, CommandConversation(what, command, params), request)
        return CommandDone(did=what, said=said)

    def _arm(self, question: VehicleCommand, request: Request) -> CommandDone:
        if question.forced:
            who = request.sender.name or request.sender.operator_id or "somebody"
            _log.warning("%s: %s forces %s: %s", self.label, who, question.action, question.reason)
        numbers = (float(question.action == "arm"), float(FORCE if question.forced else 0), 0.0, 0.0, 0.0, 0.0, 0.0)
        done = self._do(question.action, words.MAV_CMD_COMPONENT_ARM_DISARM, numbers, request)
        wish = question.action == "arm"
        self._wait_for(lambda facts: facts.armed == wish, question.action, request)
        return done

    def _enter(self, mode: str, facts: VehicleFacts, request: Request) -> CommandDone:
        order = mode_order(facts.kind, mode)
        if order is None:
            known = modes_of(facts.kind)
            hint = f"{hint_at(mode, known)} It has: {', '.join(known) or 'none that is known'}"
            raise Refused("mavlink.unknown_mode", f"a {facts.kind} has no mode {mode}{hint}")
        self._contact.vehicle.give_way()
        if mode == "OFFBOARD":
            self._contact.vehicle.repeat(STILL, self._contact.now_s(), OFFBOARD_FOR_S)
            request.pause(OFFBOARD_BEFORE_S)
        numbers = (order.base, order.custom, order.sub, 0.0, 0.0, 0.0, 0.0)
        done = self._do(f"mode {mode}", words.MAV_CMD_DO_SET_MODE, numbers, request)
        self._wait_for(lambda facts: facts.mode == mode, f"mode {mode}", request)
        return done

    def _wait_for(self, is_so: Callable[[VehicleFacts], bool], what: str, request: Request) -> None:
        """An acknowledgement is a promise; the heartbeat, once a second, says what is so. The next command needs it."""
        ends_s = self._contact.now_s() + BELIEVED_AFTER_S
        while not is_so(facts := self._contact.facts()):
            if self._contact.now_s() > ends_s:
                state = f"is {'armed' if facts.armed else 'disarmed'} in {facts.mode}"
                raise Refused("mavlink.not_done", f"{what}: the vehicle accepted it, and {state}; see mavlink-log")
            if request.pause(LOOK_S):
                return

    def _take_off(self, altitude_m: float, facts: VehicleFacts, request: Request) -> CommandDone:
        if facts.kind == "px4":
            return self._do("takeoff", words.MAV_CMD_NAV_TAKEOFF, self._px4_climb(altitude_m), request)
        wanted = guided_mode(facts.kind)
        if facts.mode != wanted:
            raise Refused("mavlink.wrong_mode", f"it takes off in {wanted}, and is in {facts.mode}; ask for that first")
        return self._do("takeoff", words.MAV_CMD_NAV_TAKEOFF, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, altitude_m), request)

    def _px4_climb(self, altitude_m: float) -> tuple[float, ...]:
        """PX4 counts heights of a take-off from the sea."""
        here = self._contact.vehicle.latest("GLOBAL_POSITION_INT")
        if here is None:
            raise Refused("mavlink.no_position", "PX4 has told no position yet; wait for a fix of its satellites")
        sea_m = here.message.alt / 1000 + altitude_m
        return (0.0, 0.0, 0.0, NO_NUMBER, NO_NUMBER, NO_NUMBER, sea_m)


class MavlinkCommandConfigurer(VehicleConfigurer[VehicleParams]):
    """Arms, disarms, takes off, lands and changes the mode of an ArduPilot or PX4 vehicle."""

    connector_type = "mavlink-command"

    def configure(self) -> MavlinkCommand:
        contact = self.contact
        contact.vehicle.rates.want("GLOBAL_POSITION_INT", 0.5)  # PX4 takes off to a height above the sea
        return MavlinkCommand(self.label, contact)
