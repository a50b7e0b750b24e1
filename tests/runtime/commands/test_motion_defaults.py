"""A default that moves is a wish like any other."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import BaseModel, Field, TypeAdapter

from mosaic_core.contract.handler import DataChannelReceivable
from mosaic_core.runtime.commands.command_shaper import CommandShaper, MotionDefaults
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety
from mosaic_core.words.limits import FieldLimit


class Vector(BaseModel):
    x: float = 0.0
    y: float = 0.25


class Move(BaseModel):
    linear: Vector = Vector(x=1.5)
    turn: Vector | None = None
    speed: float = 2.0
    gear: str = "low"
    is_fast: bool = True
    needed: float = Field()


FIELDS = ("linear.x", "linear.y", "turn.y", "speed", "gear", "is_fast", "needed", "nothing", "speed.x", "turn")


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ({}, {"linear": {"x": 1.5, "y": 0.25}, "speed": 2.0}),
        ({"linear": {}, "speed": 0}, {"linear": {"y": 0.25}, "speed": 0}),
        (
            {"linear": {"x": 1.0, "y": 0.0}, "turn": {}},
            {"linear": {"x": 1.0, "y": 0.0}, "turn": {"y": 0.25}, "speed": 2.0},
        ),
        ({"linear": 5, "speed": None}, {"linear": 5, "speed": None}),
    ],
)
def test_what_is_left_out_and_moves_is_written_out(said: dict[str, Any], meant: dict[str, Any]) -> None:
    MotionDefaults(TypeAdapter(Move).json_schema(), FIELDS).complete(said)
    assert said == meant


def test_one_message_does_not_change_the_defaults_of_the_next() -> None:
    defaults = MotionDefaults(TypeAdapter(Move).json_schema(), FIELDS)
    first: dict[str, Any] = {}
    second: dict[str, Any] = {}
    defaults.complete(first)
    first["linear"]["x"] = 99.0
    defaults.complete(second)
    assert second["linear"]["x"] == 1.5


@pytest.mark.parametrize("schema", [TypeAdapter(dict[str, Any]).json_schema(), {}])
def test_a_schema_without_fields_has_no_defaults(schema: dict[str, Any]) -> None:
    message: dict[str, Any] = {}
    MotionDefaults(schema, FIELDS).complete(message)
    assert message == {}


class Roll(BaseModel):
    speed: float = 2.0
    light: bool = False


class Roller(DataChannelReceivable[Roll]):
    def handle_data(self, data: Roll) -> None:
        raise AssertionError("only shaped here")


def test_a_message_that_leaves_its_speed_out_is_slowed_and_limited() -> None:
    safety = ReceiverSafety(limits=(FieldLimit(("speed",), -0.5, 0.5),), motion_fields=("speed",))
    shaper = CommandShaper(Roller("roller"), safety, lambda: 0)
    assert shaper.limited(shaper.parsed(b"{}"), 1.0).value == Roll(speed=0.5)
    assert shaper.limited(shaper.parsed(b'{"light": true}'), 1.0).value == Roll(speed=0.5, light=True)


def test_zeros_repeat_what_the_last_command_that_acted_said_besides_its_motion() -> None:
    safety = ReceiverSafety(limits=(FieldLimit(("speed",), -0.5, 0.5),), motion_fields=("speed",))
    shaper = CommandShaper(Roller("roller"), safety, lambda: 0)
    shaper.limited(shaper.parsed(b'{"light": true}'), 1.0)
    shaper.limited(shaper.parsed(b'{"light": false}'), 1.0)
    shaper.undone()
    assert shaper.zeros() == Roll(speed=0.0, light=True)


@pytest.mark.parametrize("word", ["allOf", "anyOf", "oneOf"])
def test_a_field_behind_a_reference_among_others_has_its_default(word: str) -> None:
    either = {word: [{"type": "null"}, {"$ref": "#/$defs/Vector"}, {"properties": {"y": {"default": 9.0}}}]}
    vector = {"properties": {"y": {"default": 0.25}}}
    message: dict[str, Any] = {"linear": {}}
    MotionDefaults({"properties": {"linear": either}, "$defs": {"Vector": vector}}, ["linear.y"]).complete(message)
    assert message == {"linear": {"y": 0.25}}
