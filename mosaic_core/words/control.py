"""Every message of the control channel ``_mosaic``, once.

The operator creates the channel in its first offer (ordered, reliable, protocol ``mosaic.1``); both sides start
with :class:`Hello`. A peer that sends none within two seconds is an original one.
Times are microseconds of the sender's own monotonic clock, which ``boot_id`` names.
"""

from __future__ import annotations

import json
from typing import Any, ClassVar

from pydantic import Field, ValidationError

from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.errors import WireError
from mosaic_core.words.wire_model import WireModel, to_json

CONTROL_LABEL = "_mosaic"
CHANNEL_PROTOCOL = "mosaic.1"
"""The DCEP protocol of our own data channels: every message carries the frame header of ``machines.framing``."""
CONTROL_PROTOCOL_VERSION = 1
HELLO_TIMEOUT_S = 2.0
PING_PERIOD_S = 0.5
PEER_LOST_AFTER_S = 2.0
"""Without a word on the control channel for this long a peer counts as lost (ICE itself needs 29 s)."""

CONTROL_EXTENSIONS: dict[str, int] = {"catalogue": 1, "mediaWatch": 1, "mediaOrigin": 1, "refusals": 1}


class ControlMessage(WireModel):
    """A message on ``_mosaic``: ``{"type": …, "data": {…}}``."""

    type: ClassVar[str]

    def to_text(self) -> str:
        return to_json({"type": self.type, "data": self.wire()})


class Hello(ControlMessage):
    """First message both ways."""

    type = "hello"
    protocol: int = CONTROL_PROTOCOL_VERSION
    extensions: dict[str, int] = Field(default_factory=dict)
    software: str
    boot_id: str


class CatalogueFull(ControlMessage):
    """Robot → operator after its hello: every connector with its message schema."""

    type = "catalogue"
    catalogue: Catalogue


class Ping(ControlMessage):
    """Four-stamp ping (RFC 5905 §8): ``t0`` is when it left."""

    type = "ping"
    t0: int


class Pong(ControlMessage):
    """``t1``: when the ping arrived, ``t2``: when this answer left, both on the answerer's clock."""

    type = "pong"
    t0: int
    t1: int
    t2: int


class Bye(ControlMessage):
    """I am closing, on purpose."""

    type = "bye"
    code: str = "peer.closed"
    message: str | None = None


class MediaWatch(ControlMessage):
    """Operator → robot: send (or stop sending) this picture. Nobody watching = neither captured nor encoded."""

    type = "media.watch"
    label: str
    on: bool


class MediaOrigin(ControlMessage):
    """Robot → operator: RTP timestamp = robot monotonic time x 90 kHz + ``rtp_origin`` (mod 2^32)."""

    type = "media.origin"
    label: str
    ssrc: int
    rtp_origin: int
    boot_id: str


class MediaUnavailable(ControlMessage):
    """Robot → operator: no picture under this label, and why."""

    type = "media.unavailable"
    label: str
    code: str
    message: str | None = None


class Refusal(ControlMessage):
    """Robot → operator: a message on a connector was not accepted. ``seq`` is that of its frame."""

    type = "refusal"
    label: str
    seq: int | None = None
    code: str
    message: str | None = None


CONTROL_MESSAGES: dict[str, type[ControlMessage]] = {
    message.type: message
    for message in (Hello, CatalogueFull, Ping, Pong, Bye, MediaWatch, MediaOrigin, MediaUnavailable, Refusal)
}


def parse_control(text: str) -> ControlMessage | None:
    """Read one control message; ``None`` for an unknown type. Raises :class:`WireError`."""
    try:
        envelope: Any = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise WireError("control channel: not JSON") from error
    if not isinstance(envelope, dict) or not isinstance(envelope.get("type"), str):
        raise WireError("control channel: no envelope with a type")
    message = CONTROL_MESSAGES.get(envelope["type"])
    if message is None:
        return None
    try:
        return message.model_validate(envelope.get("data") or {})
    except ValidationError as error:
        fields = ", ".join(".".join(map(str, problem["loc"])) or "data" for problem in error.errors())
        raise WireError(f"control channel: {message.type}: wrong or missing {fields}") from error
