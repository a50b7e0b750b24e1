"""The ``mavlink-mission`` connector: upload, download and clear a vehicle's mission."""

from __future__ import annotations

import math
from typing import ClassVar, Literal

from pydantic import Field, field_validator
from pymavlink.dialects.v20 import ardupilotmega as words

from mosaic_core.contract.params import Message, unit
from mosaic_core.contract.request_handler import Request, RequestHandler
from mosaic_core.words.errors import hint_at
from mosaic_mavlink.link.contact import VehicleContact
from mosaic_mavlink.link.vehicle_configurer import VehicleConfigurer
from mosaic_mavlink.params import VehicleParams
from mosaic_mavlink.requests.converse import conversed
from mosaic_mavlink.requests.mission_words import (
    MAX_ITEMS,
    ClearMission,
    DownloadMission,
    MissionStep,
    UploadMission,
)

_COMMANDS: dict[str, int] = {
    entry.name.removeprefix("MAV_CMD_"): number
    for number, entry in words.enums["MAV_CMD"].items()
    if not entry.name.endswith("ENUM_END")
}
_NAMES = {number: name for name, number in _COMMANDS.items()}
MissionFrame = Literal["relative", "global", "terrain", "mission", "other"]
_FRAMES: dict[MissionFrame, int] = {
    "relative": words.MAV_FRAME_GLOBAL_RELATIVE_ALT,
    "global": words.MAV_FRAME_GLOBAL,
    "terrain": words.MAV_FRAME_GLOBAL_TERRAIN_ALT,
    "mission": words.MAV_FRAME_MISSION,
}
_FRAME_NAMES: dict[int, MissionFrame] = {
    **{number: name for name, number in _FRAMES.items()}, 5: "global", 6: "relative", 11: "terrain",
}  # fmt: skip
_HOME = MissionStep(words.MAV_CMD_NAV_WAYPOINT, words.MAV_FRAME_GLOBAL, (0.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0)
"""ArduPilot's missions begin with home, whose place it fills in itself."""


class MissionItem(Message):
    """One step of a mission."""

    command: str = Field(
        default="NAV_WAYPOINT", max_length=64, description="A MAV_CMD without that prefix, or a number."
    )
    latitude: float = Field(default=0.0, ge=-90, le=90, json_schema_extra=unit("deg"))
    longitude: float = Field(default=0.0, ge=-180, le=180, json_schema_extra=unit("deg"))
    altitude_m: float = Field(default=0.0, ge=-1000, le=20_000, description="As `frame` says.")
    frame: MissionFrame = Field(
        default="relative", description="Height above: home (relative), the sea (global), the ground (terrain)."
    )
    params: list[float | None] = Field(
        default=[0.0, 0.0, 0.0, 0.0], min_length=4, max_length=4, json_schema_extra=unit(""),
        description="Its param 1–4; null: as the vehicle likes.",
    )  # fmt: skip
    autocontinue: bool = True

    @field_validator("command")
    @classmethod
    def _is_known(cls, command: str) -> str:
        if command.isascii() and command.isdigit() and int(command) <= 0xFFFF:
            return command
        name = command.upper().removeprefix("MAV_CMD_")
        if name not in _COMMANDS:
            raise ValueError(f"no command {command}{hint_at(name, _COMMANDS)}")
        return name

    def step(self) -> MissionStep:
        """As the protocol has it."""
        command = int(self.command) if self.command.isdigit() else _COMMANDS[self.command]
        first, second, third, fourth = (math.nan if value is None else value for value in self.params)
        place = (self.latitude, self.longitude, self.altitude_m)
        frame = _FRAMES[self.frame]
        return MissionStep(command, frame, (first, second, third, fourth), *place, self.autocontinue)


class MissionQuestion(Message):
    """What to do with the vehicle's mission."""

    action: Literal["upload", "download", "clear"]
    items: list[MissionItem] = Field(default=[], max_length=MAX_ITEMS, description="For `upload`, without home.")

    @field_validator("items")
    @classmethod
    def _can_be_uploaded(cls, items: list[MissionItem]) -> list[MissionItem]:
        strange = next((place for place, item in enumerate(items) if item.frame not in _FRAMES), None)
        if strange is not None:
            raise ValueError(f"item {strange} has the frame {items[strange].frame}, which can't be uploaded")
        return items


class MissionAnswer(Message):
    """The mission as the vehicle has it now."""

    items: list[MissionItem]


class MavlinkMission(RequestHandler[MissionQuestion, MissionAnswer]):
    """Exchanges a whole mission, one at a time. It starts none: that is the mode AUTO or MISSION."""

    requires_lease = True
    at_once: ClassVar[int] = 1
    answer_within_s: ClassVar[float] = 300.0

    def __init__(self, label: str, contact: VehicleContact) -> None:
        super().__init__(label)
        self._contact = contact

    def answer(self, question: MissionQuestion, request: Request) -> MissionAnswer:
        """On the handler's own thread."""
        has_home = self._contact.facts().kind != "px4"
        if question.action == "download":
            steps: list[MissionStep] = conversed(self._contact, DownloadMission(), request)
            return MissionAnswer(items=[item_of(one) for one in steps[int(has_home) :]])
        if question.action == "clear" or not question.items:
            conversed(self._contact, ClearMission(), request)
            return MissionAnswer(items=[])
        wanted = [one.step() for one in question.items]
        conversed(self._contact, UploadMission(((_HOME,) if has_home else ()) + tuple(wanted)), request)
        return MissionAnswer(items=question.items)


def item_of(step: MissionStep) -> MissionItem:
    """For people. Of a frame without degrees only command and params are told."""
    frame = _FRAME_NAMES.get(step.frame, "other")
    has_place = abs(step.x) <= 90 and abs(step.y) <= 180 and frame not in ("other", "mission")
    return MissionItem(
        command=_NAMES.get(step.command, str(step.command)),
        latitude=step.x if has_place else 0.0,
        longitude=step.y if has_place else 0.0,
        altitude_m=max(-1000.0, min(20_000.0, step.z)),
        frame=frame,
        params=[value if math.isfinite(value) else None for value in step.params],
        autocontinue=step.autocontinue,
    )


class MavlinkMissionConfigurer(VehicleConfigurer[VehicleParams]):
    """The mission of an ArduPilot or PX4 vehicle: upload, download, clear."""

    connector_type = "mavlink-mission"

    def configure(self) -> MavlinkMission:
        return MavlinkMission(self.label, self.contact)
