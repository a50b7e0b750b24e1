"""A robot with GStreamer's webrtcbin: a pipeline with an encoder per operator, as its examples have it, or one encoder
whose packets a tee gives to all.
"""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from video_bench.gstreamer import answered, binding, encoded, push, sent, vp8_of
from video_bench.scene import Image
from video_bench.serving import BITRATE_BPS, Camera, serve

ENCODING_THREADS = "source"
"""GStreamer names a thread after the pad that feeds it: those of the elements ``source`` convert, encode and pack. What
is behind a ``queue`` has a thread of its own."""


async def serve_each(pipe: Connection, orders: Connection, pictures: list[Image], n: int) -> None:
    """The plain way: an encoder per operator."""
    gi = binding()

    def pipeline_of(payload_type: str) -> str:
        packets = encoded(_size(pictures), BITRATE_BPS, payload_type)
        return f"{packets} ! queue ! {sent(payload_type, 'peer0')}"

    pipelines = []
    for _ in range(n):
        offer = await asyncio.to_thread(pipe.recv)
        pipeline = gi.Gst.parse_launch(pipeline_of(vp8_of(offer)))
        pipelines.append(pipeline)
        pipeline.set_state(gi.Gst.State.PLAYING)
        pipe.send(await asyncio.to_thread(answered, gi, pipeline.get_by_name("peer0"), offer))
    await _film(gi, pipelines, orders, pictures)


async def serve_shared(pipe: Connection, orders: Connection, pictures: list[Image], n: int) -> None:
    """A tee after the encoder: all operators get the same packets, at the bit rate of one."""
    gi = binding()
    offer = await asyncio.to_thread(pipe.recv)
    payload_type = vp8_of(offer)
    branches = (f"packets. ! queue leaky=downstream ! {sent(payload_type, f'peer{number}')}" for number in range(n))
    packets = encoded(_size(pictures), BITRATE_BPS, payload_type)
    pipeline = gi.Gst.parse_launch(f"{packets} ! tee name=packets {' '.join(branches)}")
    pipeline.set_state(gi.Gst.State.PLAYING)
    for number in range(n):
        if number:
            offer = await asyncio.to_thread(pipe.recv)
        pipe.send(await asyncio.to_thread(answered, gi, pipeline.get_by_name(f"peer{number}"), offer))
    await _film(gi, [pipeline], orders, pictures)


async def _film(gi: Any, pipelines: list[Any], orders: Connection, pictures: list[Image]) -> None:
    sources = [pipeline.get_by_name("source") for pipeline in pipelines]

    def post(image: Image, at_s: float) -> None:
        for source in sources:
            push(gi, source, image)

    camera = Camera(pictures, post)
    await serve(orders, encoding_cpu_s())
    camera.end()
    for pipeline in pipelines:
        pipeline.set_state(gi.Gst.State.NULL)


def _size(pictures: list[Image]) -> tuple[int, int]:
    height, width = pictures[0].shape[:2]
    return width, height


def encoding_cpu_s() -> Callable[[], float]:
    """Seconds of CPU of this process's encoding threads, in ticks of the kernel (10 ms)."""
    ticks_per_s = os.sysconf("SC_CLK_TCK")

    def cpu_s() -> float:
        ticks = 0
        for task in Path("/proc/self/task").iterdir():
            name, _, fields = (task / "stat").read_text().partition("(")[2].rpartition(")")
            if name.startswith(ENCODING_THREADS):
                ticks += sum(map(int, fields.split()[11:13]))
        return ticks / ticks_per_s

    return cpu_s
