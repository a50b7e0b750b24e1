"""Every message of the signaling sockets, once: ``{"type": …, "data": …}``.

The dialect is the newest of the original servers and robots (S2/C2); the spellings of older ones are accepted
on receipt. Keys that only we know are optional and are sent only to those who announced the extension.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, ClassVar

from pydantic import Field, ValidationError, field_validator

from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.errors import WireError
from mosaic_core.words.ice import IceServer
from mosaic_core.words.wire_model import PlainText, WireModel, to_json, wrong_fields

SIZE_BEFORE_AUTHORIZATION = 8 * 1024
"""Bytes of one WebSocket frame before authorization."""
SIZE_AFTER_AUTHORIZATION = 256 * 1024
"""Bytes of one WebSocket frame after authorization: Chromium's offer with 16 video lines takes 80 KB."""
LONGEST_SPELLING = 100
"""Characters of a type that are repeated in an echo."""

EXTENSIONS: dict[str, int] = {"catalogue": 1, "multiPeer": 1, "tickets": 1, "iceServers": 1, "closeReasons": 1}
"""What we can do beyond the original protocol: name and version. The lower version of the two sides counts."""


def agreed_extensions(offered: dict[str, int] | None, known: dict[str, int] = EXTENSIONS) -> dict[str, int]:
    """The extensions both sides know, each in the lower version."""
    return {name: min(version, known[name]) for name, version in (offered or {}).items() if name in known}


class RobotStatus(IntEnum):
    """What a robot says of itself; numbers of the original server."""

    READY_TO_CONNECT = 0
    RTC_CONNECTING = 1
    RTC_CONNECTED = 2
    RTC_DISCONNECTING = 3
    RTC_FAILED = 4
    DISCONNECTED = 5
    WS_CONNECTED = 6


class SignalingMessage(WireModel):
    """A message whose data is an object. ``type`` is the word on the wire."""

    type: ClassVar[str]

    def envelope(self) -> dict[str, Any]:
        return {"type": self.type, "data": self.wire()}

    def to_text(self) -> str:
        return to_json(self.envelope())


class AuthorizeRequest(SignalingMessage):
    """Server → both, at once after the upgrade. ``data`` is null toward those who know no extension."""

    type = "authorize.req"
    extensions: dict[str, int] | None = None

    def envelope(self) -> dict[str, Any]:
        return {"type": self.type, "data": self.wire() or None}


class Authorize(SignalingMessage):
    """Who I am: a robot sends ``robotId`` (+ ``data``, its token), an operator ``accessToken``."""

    type = "authorize"
    robot_id: str | None = None
    data: str | None = None
    access_token: str | None = None
    extensions: dict[str, int] | None = None


class AuthorizeResult(SignalingMessage):
    """Server → both: a bare integer, 100 for success."""

    type = "authorize.res"
    code: int

    def envelope(self) -> dict[str, Any]:
        return {"type": self.type, "data": self.code}


class TicketKey(WireModel):
    """A public key (Ed25519, raw 32 bytes, base64url) with which the server signs tickets."""

    kid: str
    x: str


class SessionWelcome(SignalingMessage):
    """Server → those who accepted extensions, after ``authorize.res`` 100."""

    type = "session.welcome"
    server: str
    extensions: dict[str, int]
    ice_servers: tuple[IceServer, ...] = ()
    keys: tuple[TicketKey, ...] = ()


class StatusUpdate(SignalingMessage):
    """Robot → server, or (with ``robotId``) server → operators."""

    type = "status.update"
    robot_id: str | None = None
    status: RobotStatus


class StatusSubscribe(SignalingMessage):
    """Operator → server: *replaces* the robots to hear of."""

    type = "status.subscribe"
    robot_ids: tuple[str, ...]


class StatusUnsubscribe(SignalingMessage):
    """User → server: hear no more of these robots' status."""

    type = "status.unsubscribe"
    robot_ids: tuple[str, ...]


class PingPing(SignalingMessage):
    """Server → both: are you there?"""

    type = "ping.ping"
    ping_id: str


class PingPong(SignalingMessage):
    """Both → server: the answer, with the same id."""

    type = "ping.pong"
    ping_id: str


class OperatorIdentity(WireModel):
    """Who is at the other end, as the server knows them. ``role`` on this robot: observer, operator or supervisor.

    ``program``: the account is marked as a program's and can never pass for a person.
    """

    id: str
    name: PlainText
    role: str = "operator"
    program: bool = False


class PrepareConnection(SignalingMessage):
    """Server → robot, before the offer. Everything but the id is ours."""

    type = "signaling.prepare_connection"
    rtc_connection_id: str
    session_id: str | None = None
    operator: OperatorIdentity | None = None
    ticket: str | None = None
    ice_servers: tuple[IceServer, ...] | None = None
    is_local: bool | None = None
    """The operator asked over the loopback of the server's machine."""


class SdpOffer(SignalingMessage):
    """Operator → robot. ``tracks`` maps the mid of each media line to the label of the wanted connector."""

    type = "signaling.send_sdp_offer"
    rtc_connection_id: str
    sdp_offer: str
    tracks: dict[str, str] | None = None


class SdpAnswer(SignalingMessage):
    """Robot → operator."""

    type = "signaling.send_sdp_answer"
    rtc_connection_id: str
    sdp_answer: str


class IceCandidate(WireModel):
    """Exactly the three keys that the original server takes."""

    candidate: str
    sdp_mid: str
    sdp_m_line_index: int = Field(default=0, alias="sdpMLineIndex")

    @field_validator("sdp_m_line_index", mode="before")
    @classmethod
    def _null_is_zero(cls, value: object) -> object:
        return 0 if value is None else value


class ExchangeIceCandidate(SignalingMessage):
    """Both ways; C1 robots spell it ``signaling.send_ice_candidate``."""

    type = "signaling.exchange_ice_candidate"
    rtc_connection_id: str
    ice_candidate: IceCandidate


class ClosePeerConnection(SignalingMessage):
    """Operator → robot in the original; with ``closeReasons`` also robot → operator, with a reason code."""

    type = "signaling.close_peer_connection"
    rtc_connection_id: str
    code: PlainText | None = None
    message: PlainText | None = None


class CatalogueAnnounce(SignalingMessage):
    """Robot → server (ours): the short catalogue, after each ``session.welcome`` and when it changes."""

    type = "catalogue.announce"
    catalogue: Catalogue


class CatalogueUpdate(SignalingMessage):
    """Server → operators that subscribed to the robot and know the extension."""

    type = "catalogue.update"
    robot_id: str
    catalogue: Catalogue


class ErrorEcho(SignalingMessage):
    """A request refused by the server: ``{"type": "<request type>[.res]", "data": <ResultCode>}``."""

    type = ""
    request_type: str
    code: int

    def envelope(self) -> dict[str, Any]:
        return {"type": self.request_type, "data": self.code}


MESSAGES: dict[str, type[SignalingMessage]] = {
    message.type: message
    for message in (
        AuthorizeRequest, Authorize, SessionWelcome, StatusUpdate, StatusSubscribe, StatusUnsubscribe,
        PingPing, PingPong, PrepareConnection, SdpOffer, SdpAnswer, ExchangeIceCandidate, ClosePeerConnection,
        CatalogueAnnounce, CatalogueUpdate,
    )
}  # fmt: skip

ALIASES: dict[str, str] = {
    "signaling.send_ice_candidate": ExchangeIceCandidate.type,
    "signaling.close_connection": ClosePeerConnection.type,
    "signaling.send_close_peer_connection": ClosePeerConnection.type,
}
"""Older spellings of message types, accepted on receipt, and how they are read."""


class UnknownMessage(SignalingMessage):
    """Well-formed, but of a type that we don't know; answered or ignored, never an error."""

    type = ""
    unknown_type: str


class MalformedSignaling(WireError):
    """A frame that makes no sense; ``spelled`` is its type as the sender wrote it, if at least that was there."""

    def __init__(self, message: str, spelled: str | None = None) -> None:
        super().__init__(message)
        self.spelled = spelled


@dataclass(frozen=True, slots=True)
class SpelledMessage:
    """A message with its type as the sender wrote it, which the echo of an error repeats."""

    message: SignalingMessage
    spelled: str


def parse_signaling(text: str) -> SignalingMessage:
    """Read one frame. Raises :class:`WireError` whose ``code`` is ``signal.bad_message``.

    An integer in ``data`` is an :class:`AuthorizeResult` or an :class:`ErrorEcho`; an unknown type is an
    :class:`UnknownMessage`. Whatever is returned can be sent on.
    """
    return parse_spelled(text).message


def parse_spelled(text: str) -> SpelledMessage:
    """:func:`parse_signaling` for who answers; the error is a :class:`MalformedSignaling`."""
    try:
        envelope = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise MalformedSignaling("not JSON") from error
    if not isinstance(envelope, dict) or not isinstance(envelope.get("type"), str):
        raise MalformedSignaling("no envelope with a type")
    kind: str = envelope["type"]
    try:
        kind.encode()
    except ValueError as error:
        raise MalformedSignaling("half a surrogate pair") from error
    spelled = kind[:LONGEST_SPELLING]
    message = _read(kind, spelled, envelope.get("data"))
    try:
        message.to_text().encode()
    except (ValueError, RecursionError) as error:
        raise MalformedSignaling("half a surrogate pair, or nested too deeply", spelled) from error
    return SpelledMessage(message, spelled)


def _read(kind: str, spelled: str, data: Any) -> SignalingMessage:
    if isinstance(data, int) and not isinstance(data, bool):
        return AuthorizeResult(code=data) if kind == AuthorizeResult.type else ErrorEcho(request_type=kind, code=data)
    message = MESSAGES.get(ALIASES.get(kind, kind))
    if message is None:
        return UnknownMessage(unknown_type=spelled)
    try:
        return message.model_validate({} if data is None else data)
    except ValidationError as error:
        raise MalformedSignaling(f"{kind}: wrong or missing {wrong_fields(error)}", spelled) from error
