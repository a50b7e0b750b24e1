"""A server, a robot and a peer connection in memory, for the headless operator."""

from __future__ import annotations

import asyncio
import json
import re
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from typing import Any, TypeVar

import httpx
import pytest

from mosaic_core.machines.delivery.framing import Frame, FrameReader, PayloadKind, encode_frame
from mosaic_core.operator import MosaicOperator
from mosaic_core.words import control, signaling
from mosaic_core.words.catalogue import Catalogue, CatalogueEntry, ChannelEntry
from mosaic_core.words.data_type import Delivery, Direction, Kind, MosaicDataType
from mosaic_core.words.errors import ConnectionFailed, SignalingError

M = TypeVar("M", bound=control.ControlMessage)
ROBOT_ID = "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11"
PEER_ID = "11111111-0b52-4c1e-9a53-2f6f1f0c9b11"


def entry(label: str, type_name: str, data_type: MosaicDataType, **more: Any) -> CatalogueEntry:
    channels = more.pop("channels", (ChannelEntry(label=label, data_type=data_type),))
    return CatalogueEntry(
        label=label, type=type_name, data_type=data_type, direction=data_type.direction, channels=channels, **more
    )


CATALOGUE = Catalogue.of([
    entry("battery", "battery", MosaicDataType.JSON_R2U),
    entry(
        "cmd_vel", "cmd-vel", MosaicDataType.JSON_U2R, delivery=Delivery.LATEST,
        safety={"requires_lease": True, "resource": "motion"},
    ),
    entry("lamp", "lamp", MosaicDataType.JSON_U2R),
    entry("chat", "chat", MosaicDataType.JSON_BI, message_schema={"type": "object"}),
    entry("front", "camera", MosaicDataType.MEDIA, kind=Kind.VIDEO, channels=()),
    CatalogueEntry(
        label="link", type="connection-check", data_type=MosaicDataType.STRING_U2R, direction=Direction.BOTH,
        channels=(
            ChannelEntry(label="link-receiver", data_type=MosaicDataType.STRING_U2R),
            ChannelEntry(label="link-sender", data_type=MosaicDataType.STRING_R2U),
        ),
    ),
])  # fmt: skip


class FakeChannel:
    """Both ends of a data channel; the robot's end is ``from_operator`` and :meth:`deliver`."""

    def __init__(self, label: str, protocol: str, ordered: bool, max_retransmits: int | None) -> None:
        self.label, self.protocol, self.ordered, self.max_retransmits = label, protocol, ordered, max_retransmits
        self.is_reliable = ordered and max_retransmits is None
        self.on_message: Callable[[bytes | str], None] | None = None
        self.on_open: Callable[[], None] | None = None
        self.on_close: Callable[[], None] | None = None
        self.on_drained: Callable[[], None] | None = None
        self.is_open = False
        self.buffered_bytes = self.under_way_bytes = 0
        self.acknowledges = True
        self.window_bytes = 1024 * 1024
        self.gives_way = False
        self.from_operator: list[bytes | str] = []
        self.sent: Callable[[FakeChannel, bytes | str], None] = lambda channel, data: None
        self._reader = FrameReader()

    def give_way(self, on: bool) -> None:
        self.gives_way = on

    def open(self) -> None:
        if not self.is_open:
            self.is_open = True
            if self.on_open:
                self.on_open()

    def send(self, data: bytes | str) -> None:
        if not self.is_open:
            raise ConnectionFailed("not open", code="peer.closed")
        self.from_operator.append(data)
        self.under_way_bytes += 0 if self.acknowledges else len(data)
        self.sent(self, data)

    def close(self) -> None:
        if self.is_open:
            self.is_open = False
            if self.on_close:
                self.on_close()

    def deliver(self, payload: bytes, kind: PayloadKind = PayloadKind.JSON, **more: Any) -> None:
        assert self.on_message
        for part in encode_frame(Frame(kind, payload, **more)):
            self.on_message(part)

    def frames(self) -> list[Frame]:
        read = [FrameReader().read(data, 0.0) for data in self.from_operator if isinstance(data, bytes)]
        return [frame for frame in read if frame is not None]


class FakeVideo:
    def __init__(self) -> None:
        self.queue: asyncio.Queue[Any] = asyncio.Queue()
        self.is_stopped = False

    async def next(self) -> Any:
        return await self.queue.get()

    async def received(self) -> None:
        return None

    def rtp_timestamp(self, frame: Any) -> int | None:
        return frame if isinstance(frame, int) else None

    def stop(self) -> None:
        self.is_stopped = True


class FakeVoice:
    def send(self, sound: Any) -> bool:
        return True


def _control_message(data: bytes | str) -> control.ControlMessage:
    assert isinstance(data, bytes)
    frame = FrameReader().read(data, 0.0)
    assert frame is not None
    message = control.parse_control(frame.payload.decode())
    assert message is not None
    return message


class FakeRobot:
    """An offerer whose other end is a robot in memory. ``is_ours``: it speaks ``mosaic.1``."""

    def __init__(self) -> None:
        self.is_ours = True
        self.answers_pings = True
        self.pongs_on_stop_channel: list[control.Pong] = []
        self.opens_channels = self.acknowledges = True
        self.catalogue = CATALOGUE
        self.extensions = dict(control.CONTROL_EXTENSIONS)
        self.answer_to: Callable[[control.ControlMessage], Sequence[control.ControlMessage]] = self.granted
        """What the robot says to a message about leases, stops or the journal."""
        self.loses_stops = 0
        """So many copies of a stop get lost on the stop channel."""
        self.epoch = 6
        self.channels: dict[str, FakeChannel] = {}
        self.videos: dict[str, FakeVideo] = {}
        self.control: list[control.ControlMessage] = []
        self.stops: list[control.Stop] = []
        self.control_texts: list[str] = []
        self.is_closed = False
        self.listener: Any = None

    def __call__(self, listener: Any, ice_servers: Sequence[Any]) -> FakeRobot:
        self.listener, self.is_closed = listener, False
        self.channels, self.videos = {}, {}
        return self

    def create_channel(
        self, label: str, *, protocol: str = "", ordered: bool = True, max_retransmits: int | None = None
    ) -> FakeChannel:
        channel = self.channels[label] = FakeChannel(label, protocol, ordered, max_retransmits)
        channel.acknowledges = self.acknowledges
        if label == control.CONTROL_LABEL:
            channel.sent = self._control_sent
        elif label == control.STOP_LABEL:
            channel.sent = self._stop_sent
        elif self.opens_channels:
            asyncio.get_running_loop().call_soon(channel.open)
        return channel

    def add_video(self, label: str) -> None:
        self.videos[label] = FakeVideo()

    def add_microphone(self, label: str) -> None:
        self.videos[label] = FakeVideo()

    def add_speaker(self, label: str) -> FakeVoice:
        return FakeVoice()

    async def offer(self) -> tuple[str, Mapping[str, str]]:
        return "offer", {str(index): label for index, label in enumerate(self.videos)}

    async def accept_answer(self, sdp: str) -> None:
        if sdp != "answer":
            raise ConnectionFailed("bad answer", code="sdp.invalid")
        asyncio.get_running_loop().call_soon(self._connect)

    async def add_candidate(self, candidate: Any) -> None: ...

    def path(self) -> None:
        return None

    async def close(self) -> None:
        self.is_closed = True

    def say(self, message: control.ControlMessage) -> None:
        self.channels[control.CONTROL_LABEL].deliver(message.to_text().encode())

    def _connect(self) -> None:
        for label, video in self.videos.items():
            self.listener.track_arrived(label, video)
        self.listener.state_changed("connected")
        self.channels[control.CONTROL_LABEL].open()
        self.channels[control.STOP_LABEL].open()

    def said(self, kind: type[M]) -> list[M]:
        """What the operator has said of this kind on the control channel."""
        return [message for message in self.control if isinstance(message, kind)]

    def granted(self, message: control.ControlMessage) -> Sequence[control.ControlMessage]:
        """A robot that nobody else commands."""
        if not isinstance(message, control.LeaseRequest):
            return []
        self.epoch += 1
        holder = control.PeerInfo(peer_id=PEER_ID, name="me")
        return [
            control.LeaseReply(resource=message.resource, outcome="granted", epoch=self.epoch),
            control.LeaseState(resource=message.resource, epoch=self.epoch, holder=holder, expiry_s=2),
        ]

    def _stop_sent(self, channel: FakeChannel, data: bytes | str) -> None:
        message = _control_message(data)
        if isinstance(message, control.Pong):
            self.pongs_on_stop_channel.append(message)
            return
        assert isinstance(message, control.Stop)
        self.stops.append(message)
        if len(self.stops) > self.loses_stops:
            for answer in self.answer_to(message):
                channel.deliver(answer.to_text().encode())

    def _control_sent(self, channel: FakeChannel, data: bytes | str) -> None:
        message = _control_message(data)
        self.control.append(message)
        if not self.is_ours:
            return
        if not isinstance(message, control.Stop):
            for answer in self.answer_to(message):
                self.say(answer)
        if isinstance(message, control.Hello):
            self.say(control.Hello(software="fake", boot_id="boot", extensions=self.extensions))
            self.say(control.CatalogueFull(catalogue=self.catalogue))
        if isinstance(message, control.Resume):
            self.say(control.Resume(boot_id="boot", is_new=True))
        if isinstance(message, control.Ping) and self.answers_pings:
            self.say(control.Pong(t0=message.t0, t1=5_000_000, t2=5_000_000))


class FakeServer:
    """REST and signaling in memory; the robot's answer comes from here too."""

    def __init__(self) -> None:
        self.extensions: dict[str, int] | None = dict(signaling.EXTENSIONS)
        self.refusal: tuple[int, dict[str, Any]] | None = None
        self.robot_status = 0
        self.answers = True
        self.connector_config: str | None = None
        """What people wrote down of the robot's connectors."""
        self.requests: list[httpx.Request] = []
        self.received: list[signaling.SignalingMessage] = []
        self.raw: list[dict[str, Any]] = []
        self.sockets: list[FakeSocket] = []
        self.is_down = False

    def http(self) -> httpx.MockTransport:
        return httpx.MockTransport(self._respond)

    async def connect(self, url: str) -> FakeSocket:
        if self.is_down:
            raise SignalingError("down", code="signal.unreachable")
        socket = FakeSocket(self)
        self.sockets.append(socket)
        socket.push(signaling.AuthorizeRequest(extensions=self.extensions))
        return socket

    def push(self, message: signaling.SignalingMessage) -> None:
        self.sockets[-1].push(message)

    def heard(self, socket: FakeSocket, text: str) -> None:
        message = signaling.parse_signaling(text)
        self.received.append(message)
        self.raw.append(json.loads(text))
        if isinstance(message, signaling.Authorize):
            socket.push(signaling.AuthorizeResult(code=100))
            if message.extensions:
                socket.push(signaling.SessionWelcome(server="fake", extensions=message.extensions))
        if isinstance(message, signaling.SdpOffer) and self.answers:
            socket.push(signaling.SdpAnswer(rtc_connection_id=message.rtc_connection_id, sdp_answer="answer"))

    def _respond(self, request: httpx.Request) -> httpx.Response:
        self.requests.append(request)
        if self.refusal is not None:
            return httpx.Response(self.refusal[0], json=self.refusal[1])
        path = request.url.path
        if path.endswith("/catalogue"):
            result: Any = CATALOGUE.short().wire() if self.extensions else None
        elif re.search(r"/robots/[^/]+$", path):
            result = {"id": ROBOT_ID, "name": "r", "connectorConfig": self.connector_config}
        elif path.endswith("ice-servers"):
            return httpx.Response(200, json=[{"urls": "stun:192.0.2.1:3478"}])
        elif path.endswith("/connection"):
            result = {"sessions": [{"robotId": ROBOT_ID, "rtcSessionId": PEER_ID, "sessionId": "session-1"}]}
        elif path.endswith(("access-token", "one-time")):
            result = {"accessToken": "jwt", "existingConnection": False}
        else:
            skip = int(request.url.params["skip"])
            robot = {"status": self.robot_status, "authType": 1}
            rows = [{"id": str(index), "name": f"r{index}", **robot} for index in range(skip, 129)]
            rows.append({"id": ROBOT_ID, "name": "r129", **robot})
            result = {"data": rows[: int(request.url.params["limit"])], "count": 130}
        return httpx.Response(200, json={"resultCode": 100, "resultData": result})


class FakeSocket:
    def __init__(self, server: FakeServer) -> None:
        self._server = server
        self._frames: asyncio.Queue[str | None] = asyncio.Queue()
        self.close_code: int | None = None

    def push(self, message: signaling.SignalingMessage) -> None:
        self._frames.put_nowait(message.to_text())

    def drop(self, code: int) -> None:
        self.close_code = code
        self._frames.put_nowait(None)

    async def __aiter__(self) -> AsyncIterator[str]:
        while (text := await self._frames.get()) is not None:
            yield text

    async def send(self, text: str) -> None:
        self._server.heard(self, text)

    async def close(self, code: int = 1000, reason: str = "") -> None:
        if self.close_code is None:
            self.drop(code)


class World:
    """Everything in memory; :meth:`operator` signs in to it."""

    robot_id = ROBOT_ID
    peer_id = PEER_ID

    def __init__(self) -> None:
        self.server = FakeServer()
        self.robot = FakeRobot()

    def operator(self, **more: Any) -> MosaicOperator:
        return MosaicOperator(
            "http://127.0.0.1:9001",
            "jwt",
            open_socket=self.server.connect,
            make_offerer=self.robot,
            http=self.server.http(),
            **more,
        )


@pytest.fixture
def world() -> World:
    return World()
