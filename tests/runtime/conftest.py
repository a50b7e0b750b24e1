"""In-memory transports: a signaling socket and peer connections that a test plays the other side of."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import asynccontextmanager
from typing import Any

import pluggy
import pytest

from mosaic_core.contract import hooks
from mosaic_core.contract.devices.shared import Shared
from mosaic_core.contract.handler import Handler
from mosaic_core.machines.delivery.framing import Frame, FrameFlag, FrameReader, PayloadKind, encode_frame
from mosaic_core.machines.signaling.peer_admission import PeerIdentity, StartPeer
from mosaic_core.runtime.configuration.catalogue_entry import catalogue_entries
from mosaic_core.runtime.configuration.connector import Connector
from mosaic_core.runtime.media.plain_stream import plain_streams
from mosaic_core.runtime.robot import Robot
from mosaic_core.runtime.transport.media_transport import NO_SOUND, SoundLabels
from mosaic_core.runtime.transport.transport import AnswererListener
from mosaic_core.testing import until
from mosaic_core.words.config import ConnectorConfig, RobotConfig, SafetyConfig
from mosaic_core.words.control import (
    CHANNEL_PROTOCOL,
    CONTROL_EXTENSIONS,
    CONTROL_LABEL,
    STOP_LABEL,
    Bye,
    ControlMessage,
    Hello,
    LeaseRequest,
    Stop,
    parse_control,
)
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.delivery import DeliveryContract
from mosaic_core.words.errors import ConnectionFailed, SignalingError
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import IceCandidate

ROBOT_ID = "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11"


class FakeChannel:
    """The robot's end of a data channel; ``sent`` is what the operator got."""

    def __init__(self, label: str, protocol: str = CHANNEL_PROTOCOL, *, is_reliable: bool = True) -> None:
        self.label = label
        self.protocol = protocol
        self.is_reliable = is_reliable
        self.is_first = False
        self.is_open = True
        self.buffered_bytes = 0
        self.window_bytes = 1024 * 1024
        self.under_way_bytes = 0
        self.gives_way = False
        self.sent: list[bytes | str] = []
        self.on_message: Callable[[bytes | str], None] | None = None
        self.on_open: Callable[[], None] | None = None
        self.on_close: Callable[[], None] | None = None
        self.on_drained: Callable[[], None] | None = None
        self._seq = 0
        self.stamp_offset_s = 0.0

    def give_way(self, on: bool) -> None:
        self.gives_way = on

    def send(self, data: bytes | str) -> None:
        if not self.is_open:
            raise ConnectionFailed("closed", code="peer.closed")
        self.sent.append(data)

    def close(self) -> None:
        self.is_open = False
        if self.on_close is not None:
            self.on_close()

    # the operator's end
    def say(self, value: Any, *, seq: int | None = None, age_s: float = 0.0, epoch: int = 0) -> int:
        """Send JSON as an operator of ours does (or bare text to an original channel)."""
        text = value if isinstance(value, str) else json.dumps(value)
        assert self.on_message is not None
        if self.protocol != CHANNEL_PROTOCOL:
            self.on_message(text)
            return 0
        self._seq = self._seq + 1 if seq is None else seq
        stamp_us = int((time.monotonic() + self.stamp_offset_s - age_s) * 1e6)
        frame = Frame(PayloadKind.JSON, text.encode(), seq=self._seq, epoch=epoch, stamp_us=stamp_us)
        for piece in encode_frame(frame):
            self.on_message(piece)
        return self._seq

    def frames(self) -> list[Frame]:
        reader = FrameReader()
        read = [reader.read(data, 0.0) for data in self.sent if isinstance(data, bytes)]
        return [frame for frame in read if frame is not None]

    def values(self, *, latched: bool | None = None) -> list[Any]:
        return [
            json.loads(frame.payload)
            for frame in self.frames()
            if latched is None or bool(frame.flags & FrameFlag.LATCHED) is latched
        ]


class FakeAnswerer:
    """The robot's end of a peer connection."""

    def __init__(self, network: FakeNetwork, listener: AnswererListener, ice_servers: Sequence[IceServer]) -> None:
        self.listener = listener
        self.ice_servers = tuple(ice_servers)
        self.network = network
        self.candidates: list[IceCandidate] = []
        self.feeds: dict[str, Any] = {}
        self.is_closed = False
        self.peer_id = ""
        self._has_channels = False

    async def answer(
        self,
        offer_sdp: str,
        media_labels: Sequence[str],
        tracks: Mapping[str, str] | None,
        sound: SoundLabels = NO_SOUND,
    ) -> str:
        if offer_sdp == "bad":
            raise ConnectionFailed("no common codec", code="sdp.no_common_codec")
        lines = int(offer_sdp.removeprefix("offer:") or 0) if offer_sdp.startswith("offer:") else len(media_labels)
        for label in media_labels[:lines]:
            self.feeds[label] = self.listener.media.track_bound(label)
        if media_labels[lines:]:
            self.listener.media.tracks_unbound(media_labels[lines:])
        own = IceCandidate(candidate="candidate:1 1 udp 1 10.0.0.1 5000 typ host", sdp_mid="0")
        self.listener.candidate_found(own)
        return "answer"

    async def add_candidate(self, candidate: IceCandidate) -> None:
        self.candidates.append(candidate)

    def path(self) -> None:
        return None

    async def close(self) -> None:
        self.is_closed = True

    # the operator's end
    def open(self, label: str, protocol: str = CHANNEL_PROTOCOL, **options: Any) -> FakeChannel:
        channel = FakeChannel(label, protocol, **options)
        channel.is_first, self._has_channels = not self._has_channels, True
        self.listener.channel_opened(channel)
        return channel

    async def greet(self) -> Control:
        """Connect and say hello as an operator of ours."""
        self.listener.state_changed("connected")
        control = Control(self.open(CONTROL_LABEL))
        control.say(Hello(software="test", boot_id="b"))
        await until(lambda: control.heard("catalogue"))
        return control


class Control:
    """The operator's end of ``_mosaic``."""

    def __init__(self, channel: FakeChannel) -> None:
        self.channel = channel

    def say(self, message: ControlMessage) -> None:
        self.channel.say(json.loads(message.to_text()))

    def heard(self, kind: str) -> list[Any]:
        messages = [parse_control(frame.payload.decode()) for frame in self.channel.frames()]
        return [message for message in messages if message is not None and message.type == kind]


class Operator:
    """An operator of ours beside the robot, with the channels that it opens first; ``epoch``: of the lease it holds."""

    def __init__(self, end: FakeAnswerer, peer_id: str) -> None:
        self.end = end
        self.peer_id = peer_id
        self.epoch = 0
        self.control = Control(end.open(CONTROL_LABEL))
        self.stops = Control(end.open(STOP_LABEL))

    def say(self, message: ControlMessage) -> None:
        self.control.say(message)

    def heard(self, kind: str) -> list[Any]:
        return self.control.heard(kind)

    def codes(self, kind: str = "refusal") -> list[str]:
        return [message.code for message in self.heard(kind)]

    async def hears(self, kind: str, count: int = 1) -> Any:
        """The ``count``-th message of this kind."""
        await until(lambda: len(self.heard(kind)) >= count)
        return self.heard(kind)[count - 1]

    def open(self, label: str, protocol: str = CHANNEL_PROTOCOL) -> FakeChannel:
        return self.end.open(label, protocol)

    async def take(self, resource: str = "motion", **more: Any) -> int:
        """Ask for the lease; its epoch, which :attr:`epoch` remembers."""
        before = len(self.heard("lease.reply"))
        self.say(LeaseRequest(resource=resource, **more))
        reply = await self.hears("lease.reply", before + 1)
        assert reply.outcome == "granted", reply
        self.epoch = reply.epoch
        return self.epoch

    def stop(self, stop_id: str = "s1", reason: str = "") -> None:
        self.stops.say(Stop(id=stop_id, reason=reason))

    async def stops_ack(self) -> Any:
        """The first acknowledgement on the stop channel."""
        await until(lambda: self.stops.heard("stop.ack"))
        return self.stops.heard("stop.ack")[0]

    def leave(self, code: str = "peer.closed") -> None:
        self.say(Bye(code=code))


class FakeSocket:
    """The robot's end of a signaling socket; the test is the server."""

    def __init__(self) -> None:
        self.sent: list[dict[str, Any]] = []
        self._frames: asyncio.Queue[str | None] = asyncio.Queue()
        self.close_code: int | None = None
        self.closed_by_robot: int | None = None

    async def __aiter__(self) -> AsyncIterator[str]:
        while (frame := await self._frames.get()) is not None:
            yield frame

    async def send(self, text: str) -> None:
        self.sent.append(json.loads(text))

    async def close(self, code: int = 1000, reason: str = "") -> None:
        if self.close_code is None:
            self.closed_by_robot = self.close_code = code
        self._frames.put_nowait(None)

    # the server's end
    def push(self, kind: str, data: Any = None) -> None:
        self._frames.put_nowait(json.dumps({"type": kind, "data": data}))

    def drop(self, code: int = 1006) -> None:
        self.close_code = code
        self._frames.put_nowait(None)

    def got(self, kind: str) -> list[Any]:
        return [message.get("data") for message in self.sent if message["type"] == kind]


class FakeNetwork:
    """Everything outside of the robot."""

    def __init__(self) -> None:
        self.sockets: list[FakeSocket] = []
        self.answerers: dict[str, FakeAnswerer] = {}
        self.order: list[FakeAnswerer] = []
        self.is_down = False
        self.attempts = 0

    async def connect(self, url: str) -> FakeSocket:
        self.attempts += 1
        if self.is_down:
            raise SignalingError("connection refused", code="signal.unreachable")
        socket = FakeSocket()
        self.sockets.append(socket)
        socket.push("authorize.req")
        return socket

    def make_answerer(self, listener: AnswererListener, ice_servers: Sequence[IceServer]) -> FakeAnswerer:
        answerer = FakeAnswerer(self, listener, ice_servers)
        self.order.append(answerer)
        return answerer

    @property
    def socket(self) -> FakeSocket:
        return self.sockets[-1]

    async def ready(self, extensions: dict[str, int] | None = None) -> FakeSocket:
        """Let the newest socket through authorization; with ``extensions`` as a server of ours."""
        await until(lambda: self.sockets)
        socket = self.sockets[-1]
        await until(lambda: socket.got("authorize"))
        socket.push("authorize.res", 100)
        await until(lambda: socket.got("status.update"))
        return socket

    async def offer(self, peer_id: str = "p1", sdp: str = "offer", **data: Any) -> FakeAnswerer:
        """An operator's offer arrives; the robot's end of the new peer connection."""
        before = len(self.order)
        socket = self.sockets[-1]
        socket.push("signaling.prepare_connection", {"rtcConnectionId": peer_id})
        socket.push("signaling.send_sdp_offer", {"rtcConnectionId": peer_id, "sdpOffer": sdp, **data})
        await until(lambda: len(self.order) > before)
        return self.order[-1]


def connector_of(
    *handlers: Handler,
    label: str | None = None,
    delivery: Delivery | DeliveryContract | None = None,
    timeout_s: float | None = None,
    safety: Mapping[str, Any] | None = None,
) -> Connector:
    """A built connector without a YAML file."""
    name = label or handlers[0].label
    contract = DeliveryContract(mode=delivery) if isinstance(delivery, Delivery) else delivery
    limits = SafetyConfig.model_validate({"timeout_s": timeout_s, **(safety or {})})
    entries = catalogue_entries(name, "test", handlers, limits, contract)
    return Connector(ConnectorConfig(type="test", label=name, delivery=contract), handlers, entries, limits)


class Hooks:
    """Records every hook."""

    def __init__(self) -> None:
        self.calls: list[tuple[str, dict[str, Any]]] = []

    def of(self, name: str) -> list[dict[str, Any]]:
        return [arguments for called, arguments in self.calls if called == name]

    @hooks.hookimpl
    def mosaic_robot_state_changed(self, state: str) -> None:
        self.calls.append(("state", {"state": state}))

    @hooks.hookimpl
    def mosaic_peer_connected(self, sender: Any) -> None:
        self.calls.append(("connected", {"sender": sender}))

    @hooks.hookimpl
    def mosaic_peer_closed(self, sender: Any, code: str) -> None:
        self.calls.append(("closed", {"sender": sender, "code": code}))

    @hooks.hookimpl
    def mosaic_connector_failed(self, label: str, error: BaseException, restart_in_s: float) -> None:
        self.calls.append(("failed", {"label": label, "error": error, "restart_in_s": restart_in_s}))

    @hooks.hookimpl
    def mosaic_lease_changed(self, resource: str, holder: Any, epoch: int, cause: str) -> None:
        who = holder.name if holder else None
        self.calls.append(("lease", {"resource": resource, "holder": who, "epoch": epoch, "cause": cause}))

    @hooks.hookimpl
    def mosaic_stop_changed(self, is_stopped: bool, by: str, reason: str) -> None:
        self.calls.append(("stop", {"is_stopped": is_stopped, "by": by, "reason": reason}))

    @hooks.hookimpl
    def mosaic_loop_blocked(self, label: str, place: str, duration_s: float) -> None:
        self.calls.append(("blocked", {"label": label, "place": place, "duration_s": duration_s}))

    @hooks.hookimpl
    def mosaic_command_received(self, label: str, sender: Any, accepted: bool, code: str) -> None:
        self.calls.append(("command", {"label": label, "accepted": accepted, "code": code}))


class Scene:
    """A running robot and everything around it."""

    def __init__(self, robot: Robot, network: FakeNetwork, hooks_seen: Hooks) -> None:
        self.robot = robot
        self.network = network
        self.hooks = hooks_seen

    async def offered(self, *offer: str, **more: Any) -> FakeAnswerer:
        """The peer connection of an operator whose offer the server passes on; it has said nothing yet."""
        await self.network.ready()
        return await self.network.offer(*offer, **more)

    async def greeted(self, *offer: str, **more: Any) -> tuple[FakeAnswerer, Control]:
        """As :meth:`offered`, of an operator of ours that has connected and said hello."""
        end = await self.offered(*offer, **more)
        return end, await end.greet()

    async def connects(
        self,
        name: str,
        *,
        role: Any = "operator",
        session_id: str = "",
        is_program: bool = False,
        offer: str = "offer",
    ) -> FakeAnswerer:
        """Somebody's peer connection, as the server's ticket describes its owner; it has said nothing yet."""
        await until(lambda: self.robot._live is not None)
        before = len(self.network.order)
        who = PeerIdentity(session_id or name, f"account of {name}", name, role, is_program)
        peer_id = f"peer {before} of {name}"
        self.robot._running.servers.links[0]._carry_out(StartPeer(peer_id, who, offer, None, ()))
        await until(lambda: len(self.network.order) > before)
        end = self.network.order[-1]
        end.peer_id = peer_id
        end.listener.state_changed("connected")
        return end

    async def enters(self, name: str, *, is_person: bool = True, **who: Any) -> Operator:
        """An operator of ours connects and greets."""
        end = await self.connects(name, **who)
        operator = Operator(end, end.peer_id)
        operator.say(Hello(software="test", boot_id=name, extensions=CONTROL_EXTENSIONS, is_person=is_person))
        await operator.hears("stop.state")
        return operator


@asynccontextmanager
async def _running(
    *connectors: Connector,
    shared: Shared | None = None,
    down: bool = False,
    control: Mapping[str, Any] | None = None,
) -> AsyncIterator[Scene]:
    network, seen = FakeNetwork(), Hooks()
    network.is_down = down
    plugins = pluggy.PluginManager(hooks.PROJECT)
    plugins.add_hookspecs(hooks)
    plugins.register(seen)
    config = RobotConfig.model_validate(
        {
            "server": {
                "ws_url": "ws://127.0.0.1:1/",
                "auth": {"type": "simple-token", "robot_id": ROBOT_ID, "params": {"token": "secret"}},
            },
            "control": dict(control or {}),
        }
    )
    robot = Robot(
        config,
        connectors,
        shared=shared or Shared(),
        plugins=plugins,
        connect_socket=network.connect,
        make_answerer=network.make_answerer,
        open_stream=plain_streams(lambda captured: ("prepared", captured.image, captured.captured_at_s)),
        software="mosaic-test",
    )
    task = asyncio.create_task(robot.run())
    try:
        yield Scene(robot, network, seen)
    finally:
        robot.stop()
        await asyncio.wait_for(asyncio.gather(task, return_exceptions=True), 5)


class Kit:
    """What tests of this folder use (they can't import this file: there are no test packages)."""

    running = staticmethod(_running)
    connector_of = staticmethod(connector_of)
    until = staticmethod(until)
    channel = FakeChannel
    socket = FakeSocket
    network = FakeNetwork


@pytest.fixture
def kit() -> Kit:
    return Kit()
