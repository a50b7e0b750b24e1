"""Robots of one video line, each in a process of its own: ours, and those that it is compared with."""

from __future__ import annotations

import asyncio
import multiprocessing
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from importlib.util import find_spec
from multiprocessing.connection import Connection
from typing import Any, Protocol

from video_bench.listener import CameraListener
from video_bench.plain_aiortc import NewestPicture, PlainAnswerer
from video_bench.scene import Image

from glass_bench.film import Content, Film, painter
from mosaic_core.contract.media import Captured
from mosaic_core.machines.laboratory.impaired_link import LinkProfile

PATIENCE_S = 30.0


@dataclass(frozen=True, slots=True)
class Way:
    """Who sends, and with which codec."""

    sender: str
    codec: str = "vp8"

    @property
    def name(self) -> str:
        return f"{self.sender}, {'H.264' if self.codec == 'h264' else self.codec.upper()}"


OURS, AIORTC = Way("ours"), Way("plain aiortc")
WAYS = (OURS, Way("ours", "h264"), AIORTC, Way("plain aiortc", "h264"), Way("Chromium"), Way("GStreamer"), Way("wrtc"))


def missing(way: Way) -> str | None:
    """Why this cannot be measured here."""
    if way.sender == "GStreamer":
        from video_bench.gstreamer import why_not

        return why_not()
    if way.sender == "wrtc" and find_spec("wrtc") is None:
        return "native libwebrtc is not installed: pip install wrtc"
    return None


@dataclass(frozen=True, slots=True)
class Shot:
    """What a sender sends, over which network."""

    way: Way
    size: tuple[int, int]
    content: Content = "pattern"
    network: LinkProfile | None = None


class SenderProcess:
    """The other process, from this side."""

    def __init__(self, shot: Shot) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=serve, args=(theirs, shot), daemon=True)
        self._process.start()
        theirs.close()

    async def answer(self, offer_sdp: str) -> str:
        self._pipe.send(offer_sdp)
        return await asyncio.to_thread(self._received)

    def become(self, network: LinkProfile) -> None:
        self._pipe.send(network)

    async def close(self) -> None:
        await asyncio.to_thread(self._end)

    def _received(self) -> str:
        if not self._pipe.poll(PATIENCE_S):
            raise TimeoutError("the sender's process does not answer")
        return str(self._pipe.recv())

    def _end(self) -> None:
        self._pipe.close()
        self._process.join(10)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()


# -- the sender's process ----------------------------------------------------------------------------------------------


class Sender(Protocol):
    async def answer(self, offer_sdp: str) -> str: ...

    def post(self, image: Image, captured_at_s: float) -> object:
        """On the thread of the film."""

    async def close(self) -> None: ...


def serve(pipe: Connection, shot: Shot) -> None:
    from mosaic_core.adapters.machine.event_loop import run_event_loop

    run_event_loop(_served(pipe, shot))


async def _served(pipe: Connection, shot: Shot) -> None:
    draw = painter(shot.content, shot.size)
    with ExitStack() as stack:
        become: Callable[[LinkProfile], None] = lambda _: None  # noqa: E731
        path = None
        if shot.network is not None:
            from mosaic_core.laboratory.impaired_path import ImpairedPath

            path = stack.enter_context(ImpairedPath(shot.network))
            become = path.become
        sender = _sender(shot, path)
        pipe.send(await sender.answer(await asyncio.to_thread(pipe.recv)))
        stack.callback(Film(draw, sender.post).end)
        while (order := await _next(pipe)) is not None:
            become(order)
        await sender.close()


async def _next(pipe: Connection) -> LinkProfile | None:
    try:
        order: LinkProfile = await asyncio.to_thread(pipe.recv)
        return order
    except (EOFError, ConnectionResetError):
        return None


def _sender(shot: Shot, path: Any) -> Sender:
    match shot.way.sender:
        case "ours":
            return OurSender(shot.way.codec, path)
        case "plain aiortc":
            return AiortcSender(shot.way.codec, path)
        case "GStreamer":
            from glass_bench.gstreamer_sender import GStreamerSender

            return GStreamerSender(shot.size)
        case "wrtc":
            from glass_bench.wrtc_sender import WrtcSender

            return WrtcSender(shot.size)
    raise ValueError(f"no sender {shot.way.sender!r}")


class OurSender:
    """A camera of the robot as it is, without server and catalogue."""

    def __init__(self, codec: str, path: Any) -> None:
        from mosaic_core import EncodingParams
        from mosaic_core.adapters.peers.aiortc_answerer import AiortcAnswerer
        from mosaic_core.adapters.video.shared_video import SharedVideo
        from mosaic_core.laboratory.impaired_answerer import impaired
        from mosaic_core.runtime.observation.counters import ConnectorCounters

        self._stream = SharedVideo("front", EncodingParams.model_validate({"codec": codec}), ConnectorCounters())
        make = AiortcAnswerer if path is None else impaired(AiortcAnswerer, path)
        self._answerer = make(CameraListener({"front": self._stream}), ())

    def post(self, image: Image, captured_at_s: float) -> object:
        return self._stream.offer(Captured(image, captured_at_s))

    async def answer(self, offer_sdp: str) -> str:
        return await self._answerer.answer(offer_sdp, ["front"], None)

    async def close(self) -> None:
        await self._answerer.close()
        self._stream.close()


class AiortcSender:
    """aiortc as its examples use it: an encoder per peer, its own bit rates."""

    def __init__(self, codec: str, path: Any) -> None:
        from mosaic_core.laboratory.impaired_answerer import impaired

        newest = NewestPicture()

        def make(listener: Any, ice_servers: Any) -> Any:
            return PlainAnswerer(listener, newest, codec)

        self._answerer = (make if path is None else impaired(make, path))(CameraListener({}), ())
        self.post = newest.post

    async def answer(self, offer_sdp: str) -> str:
        return str(await self._answerer.answer(offer_sdp, ["front"], None))

    async def close(self) -> None:
        await self._answerer.close()
