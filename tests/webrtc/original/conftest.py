"""A server and a dashboard as the original project's newest ones (S2) behave, played to the letter, and our robot
as a process between them.

The server is as strict as the original's parser: a key too many or too few, a wrong type, or anything before
authorization is written down, and :func:`original_site` fails the test with it.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time
import uuid
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Protocol

import pytest
from aiortc import RTCBundlePolicy, RTCConfiguration, RTCDataChannel, RTCPeerConnection, RTCSessionDescription
from aiortc.mediastreams import MediaStreamTrack
from aiortc.sdp import candidate_from_sdp
from playwright.async_api import Page, async_playwright
from websockets.asyncio.server import Server, ServerConnection, serve

from mosaic_core.testing import until

WAIT_S = 20.0
START_S = 60.0
"""Of a robot's process, on a busy machine."""
ROBOT_ID = "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11"
TOKEN = "b2xkIHN0eWxl+/=="  # noqa: S105 (of nobody)
CANDIDATE_KEYS: dict[str, type] = {"candidate": str, "sdpMid": str, "sdpMLineIndex": int}
ROBOT_MAY_SAY: dict[str, dict[str, Any]] = {
    "authorize": {"robotId": str, "data": str},
    "status.update": {"status": int},
    "ping.pong": {"pingId": str},
    "signaling.send_sdp_answer": {"rtcConnectionId": str, "sdpAnswer": str},
    "signaling.exchange_ice_candidate": {"rtcConnectionId": str, "iceCandidate": CANDIDATE_KEYS},
}
"""Every message that the original server takes from a robot, with the only keys it takes."""
CONFIG = """\
server:
  ws_url: {url}
  auth_config:
    {auth}
connectors:
{connectors}"""
WITH_TOKEN = f"{{ type: simple-token, robot_id: {ROBOT_ID}, params: {{ token: {TOKEN} }} }}"
OK = {"type": "authorize.res", "data": 100}


def misfit(value: Any, wanted: Any) -> str:
    """Why a strict reader would refuse `value`; empty if it would take it."""
    if not isinstance(wanted, dict):
        return "" if type(value) is wanted else f"{value!r} is no {wanted.__name__}"
    if not isinstance(value, dict) or set(value) != set(wanted):
        return f"keys {sorted(value) if isinstance(value, dict) else value!r} instead of {sorted(wanted)}"
    return "; ".join(filter(None, (misfit(value[key], inner) for key, inner in wanted.items())))


class OriginalServer:
    """One robot's socket. What it says is in :attr:`frames`, the numbers of its statuses in :attr:`statuses`."""

    def __init__(self, with_token: bool) -> None:
        self.frames: list[dict[str, Any]] = []
        self.statuses: list[int] = []
        self.authorized_at_s: list[float] = []
        self.violations: list[str] = []
        self.refusals: list[dict[str, Any]] = []
        """Answers to the next authorizations; then they are accepted."""
        self.operators: dict[str, Listening] = {}
        self.port = 0
        self._with_token = with_token
        self._robot: ServerConnection | None = None
        self._server: Server | None = None

    async def open(self) -> None:
        self._server = await serve(self._robot_arrived, "127.0.0.1", self.port)
        self.port = next(iter(self._server.sockets)).getsockname()[1]

    async def close(self) -> None:
        if self._server is not None:
            self._server.close()
            await self._server.wait_closed()
        self._robot = None

    @property
    def url(self) -> str:
        return f"ws://127.0.0.1:{self.port}"

    async def push(self, kind: str, data: Any) -> None:
        await self.push_text(json.dumps({"type": kind, "data": data}))

    async def push_text(self, text: str) -> None:
        assert self._robot is not None, "the robot is not connected"
        await self._robot.send(text)

    def said(self, kind: str) -> list[Any]:
        return [frame["data"] for frame in self.frames if frame["type"] == kind]

    async def sees(self, *statuses: int, timeout_s: float = WAIT_S) -> None:
        """The robot has said exactly these statuses, in this order, since it started."""
        await until(lambda: len(self.statuses) >= len(statuses), f"statuses {statuses}, are {self.statuses}", timeout_s)
        assert self.statuses == list(statuses)

    async def _robot_arrived(self, robot: ServerConnection) -> None:
        if robot.request is None or robot.request.path != "/ws/robot" or robot.subprotocol is not None:
            self.violations.append(f"a socket for {robot.request}")
            return
        await robot.send('{"type":"authorize.req","data":null}')
        is_authorized = False
        async for text in robot:
            frame = self.read(text, is_authorized)
            if frame is None:
                continue
            if frame["type"] != "authorize":
                await self._take(frame["type"], frame["data"])
                continue
            self.authorized_at_s.append(time.monotonic())
            result = self.refusals.pop(0) if self.refusals else OK
            is_authorized = result is OK
            if is_authorized:
                self._robot = robot
            await robot.send(json.dumps(result))

    def read(self, text: str | bytes, is_authorized: bool) -> dict[str, Any] | None:
        """A frame of the robot's; ``None`` and a violation if the original would refuse it."""
        problem, frame = self._judged(text, is_authorized)
        if problem:
            self.violations.append(f"{problem}: {text!r:.200}")
            return None
        self.frames.append(frame)
        return frame

    def _judged(self, text: str | bytes, is_authorized: bool) -> tuple[str, dict[str, Any]]:
        try:
            frame = json.loads(text) if isinstance(text, str) else None
        except ValueError:
            frame = None
        if not isinstance(frame, dict) or set(frame) != {"type", "data"}:
            return "no envelope of type and data alone", {}
        wanted = ROBOT_MAY_SAY.get(frame["type"])
        if wanted is None:
            return "a type that the original does not know", {}
        if frame["type"] == "authorize" and not self._with_token:
            wanted = {"robotId": str}
        elif frame["type"] != "authorize" and not is_authorized:
            return "said before authorization", {}
        return misfit(frame["data"], wanted), frame

    async def _take(self, kind: str, data: dict[str, Any]) -> None:
        if kind == "status.update":
            self.statuses.append(data["status"])
        elif kind.startswith("signaling."):
            operator = self.operators.get(data["rtcConnectionId"])
            if operator is None:
                self.violations.append(f"{kind} for nobody")
            elif kind == "signaling.send_sdp_answer":
                await operator.answered(data["sdpAnswer"])
            else:
                await operator.candidate_arrived(data["iceCandidate"])


class Listening(Protocol):
    """An operator at the server."""

    async def answered(self, sdp: str) -> None: ...
    async def candidate_arrived(self, candidate: dict[str, Any]) -> None: ...


class BrowserOperator:
    """A page in a real browser with a bare ``RTCPeerConnection``: no library, no word of ours."""

    def __init__(self, server: OriginalServer, page: Page) -> None:
        self.id = str(uuid.uuid4())
        self.server = server
        self.answers: list[str] = []
        self._page = page
        server.operators[self.id] = self

    async def run(self, script: str) -> Any:
        """``script`` is the body of an async function; ``pc`` is the peer connection, ``got`` what its channels got."""
        return await self._page.evaluate(f"async () => {{ {script} }}")

    async def begin(self, script: str) -> None:
        """Make a peer connection and, with ``script``, what it has in its first offer; offer it."""
        await self.run(
            "window.pc = new RTCPeerConnection(); window.got = {};"
            "window.open = (label) => { const one = pc.createDataChannel(label); got[label] = [];"
            "  one.onmessage = (event) => got[label].push(event.data); return one };"
            "window.only = (line, name) => line.setCodecPreferences("
            "  RTCRtpReceiver.getCapabilities('video').codecs.filter((one) => one.mimeType.endsWith(name)));" + script
        )
        await self.server.push("signaling.prepare_connection", {"rtcConnectionId": self.id})
        await self.offer()

    async def offer(self) -> None:
        """The first offer, or a further one."""
        sdp = await self.run(
            "await pc.setLocalDescription();"
            "while (pc.iceGatheringState !== 'complete')"
            "  await new Promise((next) => { pc.onicegatheringstatechange = next });"
            "return pc.localDescription.sdp"
        )
        await self.server.push("signaling.send_sdp_offer", {"rtcConnectionId": self.id, "sdpOffer": sdp})

    async def answered(self, sdp: str) -> None:
        self.answers.append(sdp)
        await self._page.evaluate("(sdp) => pc.setRemoteDescription({ type: 'answer', sdp })", sdp)

    async def candidate_arrived(self, candidate: dict[str, Any]) -> None:
        await self._page.evaluate("(candidate) => pc.addIceCandidate(candidate)", candidate)

    async def is_true(self, expression: str) -> None:
        """Wait for it."""
        await self._page.wait_for_function(expression, timeout=WAIT_S * 1000)

    async def sees_pictures(self, line: int) -> None:
        """Some are decoded on this line, and more follow."""
        await self.run(
            "const video = document.createElement('video'); video.muted = true; document.body.append(video);"
            f"video.srcObject = new MediaStream([pc.getTransceivers()[{line}].receiver.track]); await video.play();"
            "for (let seen = 0; seen < 3; seen++)"
            "  await new Promise((next) => video.requestVideoFrameCallback(next))"
        )


class OriginalOperator:
    """A dashboard page: offers, creates bare channels and sendrecv video lines, trickles three-key candidates."""

    def __init__(self, server: OriginalServer, labels: Sequence[str] = (), videos: int = 0, peer_id: str = "") -> None:
        self.id = peer_id or str(uuid.uuid4())
        self.server = server
        self.pc = RTCPeerConnection(RTCConfiguration(iceServers=[], bundlePolicy=RTCBundlePolicy.MAX_BUNDLE))
        self.received: dict[str, list[str | bytes]] = {label: [] for label in labels}
        self.tracks: list[MediaStreamTrack] = []
        self.answer = ""
        self.offered: list[str] = []
        self.candidates: list[dict[str, Any]] = []
        for _ in range(videos):  # before the channels: aiortc as the offerer mixes up bundled transports otherwise
            self.pc.addTransceiver("video", direction="sendrecv")
        self.channels: dict[str, RTCDataChannel] = {label: self._channel(label) for label in labels}
        self.pc.on("track", self.tracks.append)
        server.operators[self.id] = self

    def _channel(self, label: str) -> RTCDataChannel:
        channel = self.pc.createDataChannel(label)
        channel.on("message", self.received[label].append)
        return channel

    async def describe(self) -> str:
        """The offer of a browser that trickles: without candidates; they are in :attr:`candidates`."""
        await self.pc.setLocalDescription(await self.pc.createOffer())
        kept: list[str] = []
        mids: list[str] = []
        for line in self.pc.localDescription.sdp.splitlines():
            if line.startswith("a=mid:"):
                mids.append(line.removeprefix("a=mid:"))
            if not line.startswith(("a=candidate:", "a=end-of-candidates")):
                kept.append(line)
        found = [line[2:] for line in self.pc.localDescription.sdp.splitlines() if line.startswith("a=candidate:")]
        self.candidates = [{"candidate": line, "sdpMid": mids[0], "sdpMLineIndex": 0} for line in dict.fromkeys(found)]
        assert self.candidates, "this machine has no address for WebRTC"
        return "\r\n".join(kept) + "\r\n"

    async def prepare(self) -> None:
        """What `POST /api/v1/webrtc/connection` makes the server do."""
        await self.server.push("signaling.prepare_connection", {"rtcConnectionId": self.id})

    async def send_offer(self, sdp: str) -> None:
        await self.server.push("signaling.send_sdp_offer", {"rtcConnectionId": self.id, "sdpOffer": sdp})

    async def trickle(self, kind: str = "signaling.exchange_ice_candidate") -> None:
        for candidate in self.candidates:
            await self.server.push(kind, {"rtcConnectionId": self.id, "iceCandidate": candidate})

    async def call(self) -> None:
        """Prepare, offer, trickle."""
        sdp = await self.describe()
        await self.prepare()
        await self.send_offer(sdp)
        await self.trickle()

    async def connect(self) -> None:
        """Call until the peer connection and every channel is open."""
        await self.call()
        await until(lambda: self.pc.connectionState == "connected", "the operator is connected")
        await until(lambda: all(it.readyState == "open" for it in self.channels.values()), "all channels are open")

    async def hang_up(self, kind: str = "signaling.close_peer_connection") -> None:
        await self.server.push(kind, {"rtcConnectionId": self.id})

    def vanish(self) -> Callable[[], None]:
        """Its network is gone, both ways and without a word; the result brings it back."""
        protocols = [*self._ice()._protocols]
        transports = [protocol.transport for protocol in protocols]
        for protocol in protocols:
            protocol.transport = SimpleNamespace(sendto=_lost, close=protocol.transport.close)
            protocol.datagram_received = _lost

        def back() -> None:
            for protocol, transport in zip(protocols, transports, strict=True):
                protocol.transport = transport
                del protocol.datagram_received

        return back

    def _ice(self) -> Any:
        line = self.pc.sctp or self.pc.getTransceivers()[0].receiver
        return line.transport.transport._connection

    async def answered(self, sdp: str) -> None:
        self.answer = sdp
        await self.pc.setRemoteDescription(RTCSessionDescription(sdp, "answer"))

    async def candidate_arrived(self, candidate: dict[str, Any]) -> None:
        if not self.answer:
            self.server.violations.append("a candidate before the answer: a browser rejects it")
            return
        parsed = candidate_from_sdp(candidate["candidate"].removeprefix("candidate:"))
        parsed.sdpMid = candidate["sdpMid"]
        await self.pc.addIceCandidate(parsed)

    @property
    def streams(self) -> list[str]:
        """What stands after `a=msid:` on the lines of the answer on which the robot sends, in order."""
        lines = [section for section in self.answer.split("m=") if "a=sendonly" in section]
        return [line[7:] for section in lines for line in section.splitlines() if line.startswith("a=msid:")]

    def objects(self, label: str) -> list[dict[str, Any]]:
        """What arrived on a JSON channel; every message must be a bare text."""
        found = self.received[label]
        assert all(isinstance(message, str) for message in found), f"not text on {label}: {found[:1]!r:.80}"
        return [json.loads(message) for message in found]


def _lost(*_datagram: Any) -> None:
    """What a network does that is gone."""


class Site:
    """A server, a robot process, and how to make operators."""

    def __init__(self, server: OriginalServer, robot: asyncio.subprocess.Process) -> None:
        self.server = server
        self.robot = robot
        self.log: list[str] = []
        self.snapshots: list[dict[str, Any]] = []
        self._operators: list[OriginalOperator] = []
        self._is_stopped = False
        self._readers = [asyncio.create_task(self._read_log()), asyncio.create_task(self._read_snapshots())]

    async def _read_log(self) -> None:
        assert self.robot.stderr is not None
        async for line in self.robot.stderr:
            self.log.append(line.decode().rstrip())

    async def _read_snapshots(self) -> None:
        assert self.robot.stdout is not None
        async for line in self.robot.stdout:
            self.snapshots.append(json.loads(line))

    def operator(self, *labels: str, videos: int = 0, peer_id: str = "") -> OriginalOperator:
        made = OriginalOperator(self.server, labels, videos, peer_id)
        self._operators.append(made)
        return made

    async def is_alive(self) -> None:
        """The robot answers a ping with the same id and nothing else."""
        ping_id = str(uuid.uuid4())
        await self.server.push("ping.ping", {"pingId": ping_id})
        await until(lambda: {"pingId": ping_id} in self.server.said("ping.pong"), "the pong")
        assert self.robot.returncode is None

    def stop_robot(self) -> None:
        """SIGTERM, once: a second one would not wait for the orderly end."""
        if not self._is_stopped and self.robot.returncode is None:
            self.robot.terminate()
        self._is_stopped = True

    async def close(self) -> None:
        await asyncio.gather(*(operator.pc.close() for operator in self._operators))
        self.stop_robot()
        code = await asyncio.wait_for(self.robot.wait(), 10)
        await asyncio.gather(*self._readers)
        await self.server.close()
        assert code == 0, "\n".join(self.log[-25:])


@asynccontextmanager
async def original_site(
    tmp_path: Path, connectors: str, *, auth: str = WITH_TOKEN, refusals: Sequence[dict[str, Any]] = ()
) -> AsyncIterator[Site]:
    server = OriginalServer("token" in auth)
    server.refusals.extend(refusals)
    await server.open()
    config = tmp_path / f"robot-{server.port}.yaml"
    config.write_text(CONFIG.format(url=server.url, auth=auth, connectors=connectors))
    words = ["-m", "mosaic_core.cli.main", "run", str(config), "--json"]
    pipe = asyncio.subprocess.PIPE
    site = Site(server, await asyncio.create_subprocess_exec(sys.executable, *words, stdout=pipe, stderr=pipe))
    try:
        if not refusals:
            await server.sees(0, timeout_s=START_S)
        yield site
    finally:
        await site.close()
    assert server.violations == []


@pytest.fixture
def original_robot(
    tmp_path: Path, request: pytest.FixtureRequest, record_property: Callable[[str, object], None]
) -> Any:
    """``async with original_robot(connectors_yaml) as site``: our robot on an original server; a pair of the table."""
    if "record_property" not in request.node.function.__code__.co_varnames:  # else it says itself what it proves
        name = request.node.originalname.removeprefix("test_").replace("_", " ")
        record_property("pair", f"our robot | original server and page (S2), strict to the letter | {name}")
    return lambda connectors, **more: original_site(tmp_path, connectors, **more)


@pytest.fixture
def browser_operator(chromium: str) -> Any:
    """``async with browser_operator(site) as page``: a bare page in Chromium on the server of ``site``."""

    @asynccontextmanager
    async def opened(site: Site) -> AsyncIterator[BrowserOperator]:
        async with async_playwright() as playwright:
            words = ["--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run"]
            browser = await playwright.chromium.launch(executable_path=chromium, args=words)
            try:
                yield BrowserOperator(site.server, await browser.new_page())
            finally:
                await browser.close()

    return opened


@pytest.fixture
def original_server() -> OriginalServer:
    """Its strict reader alone; it listens nowhere."""
    return OriginalServer(with_token=True)


@pytest.fixture(name="until")
def until_fixture() -> Any:
    return until
