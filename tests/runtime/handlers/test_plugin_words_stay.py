"""What a plugin raises is for the robot's log: it may name files or passwords. No operator gets a word of it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from pydantic import field_validator

from mosaic_core import (
    DataChannelJsonReceivable,
    DataChannelReceivable,
    DataChannelSendable,
    DeviceGone,
    MediaTrackHandler,
    Message,
)
from mosaic_core.words.control import DeliveryWatch, MediaWatch

SECRET = "hunter2 at /dev/hidden"  # noqa: S105


class Sends(DataChannelSendable[str]):
    def messages(self) -> Iterator[str]:
        raise OSError(SECRET)


class Gone(DataChannelSendable[str]):
    def messages(self) -> Iterator[str]:
        raise DeviceGone(SECRET, SECRET)


class Leaves(DataChannelJsonReceivable):
    def handle_data(self, data: dict[str, Any]) -> None:
        raise KeyError(SECRET)


class LeavesAsync(DataChannelJsonReceivable):
    async def handle_data(self, data: dict[str, Any]) -> None:
        raise DeviceGone(SECRET)


class Unsafe(DataChannelJsonReceivable):
    timeout_s = 0.05

    def handle_data(self, data: dict[str, Any]) -> None:
        """Takes it."""

    def make_safe(self, cause: str) -> None:
        raise RuntimeError(SECRET)


class Odd(Message):
    v: int

    @field_validator("v")
    @classmethod
    def _breaks(cls, value: int) -> int:
        raise RuntimeError(SECRET)


class Validates(DataChannelReceivable[Odd]):
    def handle_data(self, data: Odd) -> None:
        """Never gets here."""


class Camera(MediaTrackHandler):
    def frames(self) -> Iterator[Any]:
        raise OSError(SECRET)


def everything_told(scene: Any, channels: list[Any]) -> str:
    """What left the robot: signaling, and every message on every channel."""
    frames = [str(frame.payload) for channel in channels for frame in channel.frames()]
    bare = [str(data) for channel in channels for data in channel.sent]
    return "\n".join([*frames, *bare, *(json.dumps(socket.sent) for socket in scene.network.sockets)])


async def test_no_operator_gets_a_word_of_what_a_plugin_raised(kit: Any) -> None:
    senders = [Sends("sends"), Gone("gone")]
    receivers = [Leaves("leaves"), LeavesAsync("leaves_async"), Unsafe("unsafe"), Validates("validates")]
    handlers = [*senders, *receivers, Camera("camera")]
    async with kit.running(*(kit.connector_of(handler) for handler in handlers)) as scene:
        await scene.network.ready()
        ann = await scene.enters("ann")
        channels = [ann.control.channel, ann.stops.channel, *(ann.open(one.label) for one in (*senders, *receivers))]
        ann.say(DeliveryWatch(on=True))
        ann.end.listener.media.track_bound("camera")
        ann.say(MediaWatch(label="camera", on=True))
        for channel in channels[-len(receivers) :]:
            channel.say({"v": 1})
        ann.stop()
        await ann.stops_ack()
        failing = {"sends", "gone", "leaves", "leaves_async", "validates"}
        await kit.until(lambda: failing <= {failed["label"] for failed in scene.hooks.of("failed")})
        await kit.until(lambda: len(ann.heard("refusal")) >= 3)
        told = everything_told(scene, channels)
        assert "could not carry it out" in told, "the refusals are among it"
        assert "plugin.no_device" in told, "so is why the device does not send"
        assert not [word for word in ("hunter2", "hidden", "KeyError", "RuntimeError") if word in told]
