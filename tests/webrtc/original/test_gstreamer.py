"""GStreamer's webrtcbin, with the RSA certificate that it makes by default, in the original dialect: as an operator of
our robot, and as a robot for our operator behind our server.
"""

from __future__ import annotations

import asyncio
import json
import subprocess
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from mosaic_core.operator import MosaicOperator, RobotConnector
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.errors import ConnectionFailed

pytestmark = [pytest.mark.webrtc, pytest.mark.timeout(240)]

WAIT_S = 60.0
PYTHON = "/usr/bin/python3"
"""Debian's, which has GStreamer's binding."""
PROGRAM = Path(__file__).with_name("gstreamer_peer.py")
ELEMENTS = (
    "webrtcbin", "nicesrc", "dtlssrtpenc", "srtpenc", "sctpenc", "videoconvert", "videotestsrc", "appsink", "vp8enc",
    "vp8dec", "rtpvp8pay", "rtpvp8depay", "openh264enc", "openh264dec", "h264parse", "rtph264pay", "rtph264depay",
)  # fmt: skip
PACKAGES = (
    "python3-gst-1.0 gir1.2-gst-plugins-bad-1.0 gstreamer1.0-nice gstreamer1.0-plugins-good gstreamer1.0-plugins-bad"
)
CHECK = f"""
import gi
gi.require_version("GstWebRTC", "1.0")
from gi.repository import Gst, GstSdp, GstWebRTC
Gst.init(None)
lacking = [name for name in {ELEMENTS} if Gst.ElementFactory.find(name) is None]
assert not lacking, lacking
print(Gst.version().major, Gst.version().minor, sep=".")
"""
CODECS = pytest.mark.parametrize("codec", ["VP8", "H264"])
ROBOT = """\
  - { type: connection-check, label: link }
  - { type: host-load, label: load, params: { period_s: 0.2 } }
  - { type: test-pattern, label: front, params: { width: 320, height: 240, fps: 10 } }
"""


@pytest.fixture(scope="module")
def version() -> str:
    """Of the GStreamer that is installed with all that is needed; else the test is skipped (in CI: fails)."""
    try:
        done = subprocess.run([PYTHON, "-c", CHECK], capture_output=True, text=True, timeout=WAIT_S)
    except FileNotFoundError:
        pytest.skip(f"no {PYTHON}, whose GStreamer could be used")
    if done.returncode:
        pytest.skip(f"no GStreamer ({done.stderr.strip().splitlines()[-1]}): apt install {PACKAGES}")
    return done.stdout.strip()


class GStreamerPeer:
    """The program, and what it has told so far."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self.process = process
        self.told: list[dict[str, Any]] = []
        self.heard: Callable[[dict[str, Any]], Awaitable[None]] | None = None
        """Takes descriptions and candidates, one after the other."""
        self.log: list[str] = []
        self.readers = [asyncio.create_task(self._read()), asyncio.create_task(self._read_log())]
        self._changed = asyncio.Event()

    async def _read(self) -> None:
        assert self.process.stdout is not None
        async for line in self.process.stdout:
            said = json.loads(line)
            if self.heard is not None and {"offer", "answer", "candidate"} & set(said):
                await self.heard(said)
            self.told.append(said)
            self._changed.set()

    async def _read_log(self) -> None:
        assert self.process.stderr is not None
        async for line in self.process.stderr:
            self.log.append(line.decode().rstrip())

    def say(self, **what: Any) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps(what).encode() + b"\n")

    async def tells(self, what: str, wanted: Callable[[dict[str, Any]], bool], times: int = 1) -> dict[str, Any]:
        """Until it has told so often what is ``wanted``; the last one."""
        try:
            async with asyncio.timeout(WAIT_S):
                while len(found := [one for one in self.told if wanted(one)]) < times:
                    self._changed.clear()
                    await self._changed.wait()
        except TimeoutError:
            pytest.fail(f"GStreamer never told of {what}, but {self.told[-5:]!s:.500}\n" + "\n".join(self.log[-15:]))
        return found[-1]

    async def opens(self, label: str) -> None:
        await self.tells(f"{label} being open", lambda one: one.get("opened") == label)

    async def says(self, label: str, text: str) -> None:
        await self.tells(f"{text!r} on {label}", lambda one: one.get("message") == label and one.get("text") == text)


@asynccontextmanager
async def gstreamer(*words: str) -> AsyncIterator[GStreamerPeer]:
    pipe = asyncio.subprocess.PIPE
    program = await asyncio.create_subprocess_exec(
        PYTHON, str(PROGRAM), *words, stdin=pipe, stdout=pipe, stderr=pipe, limit=1 << 20
    )
    peer = GStreamerPeer(program)
    try:
        yield peer
    finally:
        assert program.stdin is not None
        program.stdin.close()
        try:
            await asyncio.wait_for(program.wait(), 10)
        except TimeoutError:
            program.kill()
        await asyncio.gather(program.wait(), *peer.readers)
        assert not [line for line in peer.log if "Error" in line], peer.log


class GStreamerOperator:
    """What the stand-in of the original server talks to."""

    def __init__(self, site: Any, peer: GStreamerPeer) -> None:
        self.id = "33333333-0b52-4c1e-9a53-2f6f1f0c9b11"
        self.pc = self
        self._site, self._peer = site, peer
        site.server.operators[self.id] = self

    async def call(self) -> None:
        """GStreamer offers and trickles; it knows the number of a line, not its name."""
        await self._site.server.push("signaling.prepare_connection", {"rtcConnectionId": self.id})
        self._peer.heard = self._relay
        for said in list(self._peer.told):
            await self._relay(said)

    async def _relay(self, said: dict[str, Any]) -> None:
        if "offer" in said:
            data = {"rtcConnectionId": self.id, "sdpOffer": said["offer"]}
            await self._site.server.push("signaling.send_sdp_offer", data)
        elif "candidate" in said:
            candidate = {"candidate": said["candidate"], "sdpMid": "", "sdpMLineIndex": said["line"]}
            data = {"rtcConnectionId": self.id, "iceCandidate": candidate}
            await self._site.server.push("signaling.exchange_ice_candidate", data)

    async def answered(self, sdp: str) -> None:
        self._peer.say(answer=sdp)

    async def candidate_arrived(self, candidate: dict[str, Any]) -> None:
        self._peer.say(candidate=candidate["candidate"], line=candidate["sdpMLineIndex"])

    async def close(self) -> None:
        """Its program ends by itself."""


@CODECS
@pytest.mark.parametrize("bundle", ["none", "max-bundle"])
async def test_gstreamer_as_an_operator_of_our_robot(
    codec: str, bundle: str, version: str, original_robot: Any, record_property: Callable[[str, object], None]
) -> None:
    """Also with a transport for each line, which is its default."""
    pair = f"our robot ↔ GStreamer operator (RSA, bundle-policy {bundle}): data both ways, {codec}"
    record_property("pair", pair)

    async with original_robot(ROBOT) as site:
        async with gstreamer("operator", codec, bundle, "load", "link-receiver", "link-sender") as peer:
            operator = GStreamerOperator(site, peer)
            await operator.call()
            for label in ("load", "link-receiver", "link-sender"):
                await peer.opens(label)
            peer.say(send="link-receiver", text="to and fro")
            await peer.says("link-sender", "to and fro")
            reading = await peer.tells("readings", lambda one: one.get("message") == "load", times=3)
            assert "cpu_percent" in json.loads(reading["text"])
            picture = await peer.tells("pictures", lambda one: "picture" in one, times=10)
            assert picture["picture"] == [320, 240]
            assert picture["colours"] > 10
        await site.is_alive()


class OriginalRobot:
    """The signaling of a robot of the original project, around GStreamer."""

    def __init__(self, socket: ClientConnection, peer: GStreamerPeer, seed: Any) -> None:
        self._socket, self._peer, self._seed = socket, peer, seed
        self._connection_id = ""
        self.is_ready = asyncio.Event()
        peer.heard = self._relay

    async def run(self) -> None:
        async for text in self._socket:
            message = json.loads(text)
            data = message["data"]
            match message["type"]:
                case "authorize.req":
                    await self._say("authorize", robotId=self._seed.robot_id, data=self._seed.robot_token)
                case "authorize.res":
                    assert data == 100
                    await self._say("status.update", status=0)
                    self.is_ready.set()
                case "ping.ping":
                    await self._say("ping.pong", pingId=data["pingId"])
                case "signaling.prepare_connection":
                    self._connection_id = data["rtcConnectionId"]
                case "signaling.send_sdp_offer":
                    self._peer.say(offer=data["sdpOffer"])
                case "signaling.exchange_ice_candidate":
                    candidate = data["iceCandidate"]
                    self._peer.say(candidate=candidate["candidate"], line=candidate["sdpMLineIndex"])

    async def _relay(self, said: dict[str, Any]) -> None:
        if "answer" in said:
            await self._say("signaling.send_sdp_answer", rtcConnectionId=self._connection_id, sdpAnswer=said["answer"])
        elif "candidate" in said:
            candidate = {"candidate": said["candidate"], "sdpMid": "", "sdpMLineIndex": said["line"]}
            await self._say(
                "signaling.exchange_ice_candidate", rtcConnectionId=self._connection_id, iceCandidate=candidate
            )

    async def _say(self, kind: str, **data: Any) -> None:
        with suppress(ConnectionClosed):  # candidates are found until the end
            await self._socket.send(json.dumps({"type": kind, "data": data}))


@CODECS
async def test_gstreamer_as_a_robot_for_our_operator(
    codec: str, version: str, server: Any, seed: Any, record_property: Callable[[str, object], None]
) -> None:
    record_property("pair", f"our Python operator and server ↔ GStreamer robot (RSA): data both ways, {codec}")

    async with gstreamer("robot", codec, "max-bundle") as peer, called(peer, server, seed) as operator:
        await use(operator, peer, seed.robot_id)


async def test_a_gstreamer_robot_that_does_not_bundle_is_told_what_to_do(version: str, server: Any, seed: Any) -> None:
    front = RobotConnector(seed.robot_id, "front", MosaicDataType.MEDIA)
    async with gstreamer("robot", "VP8", "none") as peer, called(peer, server, seed) as operator:
        with pytest.raises(ConnectionFailed, match="bundle-policy=max-bundle"):
            await operator.connect(seed.robot_id, connectors=[front], timeout_s=WAIT_S)


@asynccontextmanager
async def called(peer: GStreamerPeer, server: Any, seed: Any) -> AsyncIterator[MosaicOperator]:
    """An operator of ours, once the robot has signed in to our server."""
    async with connect(f"ws://127.0.0.1:{server.port}/ws/robot") as socket, asyncio.timeout(WAIT_S):
        robot = OriginalRobot(socket, peer, seed)
        running = asyncio.create_task(robot.run())
        try:
            await robot.is_ready.wait()
            async with await MosaicOperator.login(server.url, seed.email, seed.password) as operator:
                yield operator
        finally:
            running.cancel()


async def use(operator: MosaicOperator, peer: GStreamerPeer, robot_id: str) -> None:
    """A camera, a label that is read and one that is written."""
    connectors = [
        RobotConnector(robot_id, "front", MosaicDataType.MEDIA),
        RobotConnector(robot_id, "state", MosaicDataType.STRING_R2U),
        RobotConnector(robot_id, "cmd", MosaicDataType.STRING_U2R),
    ]
    connection = await operator.connect(robot_id, connectors=connectors, timeout_s=WAIT_S)
    assert connection.is_original
    pad = connection.sendable("cmd", MosaicDataType.STRING_U2R)
    await pad.wait_open()
    assert pad.send_data("forward")
    await peer.says("cmd", "forward")
    await peer.opens("state")
    state = connection.receivable("state", MosaicDataType.STRING_R2U)
    coming = asyncio.create_task(state.next_message(WAIT_S))
    peer.say(send="state", text="driving")
    assert (await coming).data == b"driving"
    front = connection.media("front")
    for _ in range(10):
        image = await front.next_image(WAIT_S)
        assert image.shape == (240, 320, 3)
    assert image.std() > 30
