"""The ``mavlink-parameters`` connector: get, set and list a vehicle's parameters."""

from __future__ import annotations

import math
from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

from mosaic_core.contract.params import Message, unit
from mosaic_core.contract.request_handler import Request, RequestHandler
from mosaic_mavlink.link.contact import VehicleContact
from mosaic_mavlink.link.vehicle_configurer import VehicleConfigurer
from mosaic_mavlink.params import VehicleParams
from mosaic_mavlink.requests.conversation import Conversation
from mosaic_mavlink.requests.converse import conversed
from mosaic_mavlink.requests.parameter_words import (
    GetParameter,
    ListParameters,
    ParameterValue,
    SetParameter,
)


class ParameterQuestion(Message):
    """Which parameter, and what to do with it."""

    action: Literal["get", "set", "list"]
    name: str = Field(default="", pattern=r"^([A-Za-z0-9_]{1,16})?$", description="For `get` and `set`.")
    value: float | None = Field(default=None, json_schema_extra=unit(""), description="For `set`; its unit is its own.")

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        if self.action != "list" and not self.name:
            raise ValueError(f"the action {self.action} needs a name")
        if self.action == "set" and self.value is None:
            raise ValueError("the action set needs a value")
        return self


class VehicleParameter(Message):
    """One parameter."""

    name: str
    value: float | None = Field(json_schema_extra=unit(""), description="null: no number, see `said`.")
    whole: bool = Field(description="It takes whole numbers only.")
    said: str = Field(default="", description="What the vehicle tells in place of a number: nan, inf or -inf.")


class ParameterAnswer(Message):
    """What was asked for."""

    parameters: list[VehicleParameter]


class MavlinkParameters(RequestHandler[ParameterQuestion, ParameterAnswer]):
    """Reads and writes parameters, one question at a time."""

    requires_lease = True
    at_once: ClassVar[int] = 1
    answer_within_s: ClassVar[float] = 300.0
    """A thousand parameters over a slow radio take minutes."""

    def __init__(self, label: str, contact: VehicleContact) -> None:
        super().__init__(label)
        self._contact = contact

    def answer(self, question: ParameterQuestion, request: Request) -> ParameterAnswer:
        """On the handler's own thread."""
        bytewise = self._contact.facts().kind == "px4"
        found = conversed(self._contact, _conversation(question, bytewise=bytewise), request)
        return ParameterAnswer(parameters=[_told(one) for one in found])


def _told(one: ParameterValue) -> VehicleParameter:
    if math.isfinite(one.value):
        return VehicleParameter(name=one.name, value=one.value, whole=one.is_whole)
    return VehicleParameter(name=one.name, value=None, whole=one.is_whole, said=f"{one.value}")


def _conversation(question: ParameterQuestion, *, bytewise: bool) -> Conversation:
    match question.action:
        case "get":
            return GetParameter(question.name, bytewise=bytewise)
        case "set":
            return SetParameter(question.name, question.value or 0.0, bytewise=bytewise)
        case "list":
            return ListParameters(bytewise=bytewise)


class MavlinkParametersConfigurer(VehicleConfigurer[VehicleParams]):
    """The parameters of an ArduPilot or PX4 vehicle: get, set and list."""

    connector_type = "mavlink-parameters"

    def configure(self) -> MavlinkParameters:
        return MavlinkParameters(self.label, self.contact)
