"""GStreamer's webrtcbin as a robot."""

from __future__ import annotations

import asyncio
from typing import Any

from video_bench.gstreamer import answered, binding, encoded, push, sent, vp8_of
from video_bench.scene import Image

from mosaic_core.machines.media.rung_ladder import default_ceiling_bps


class GStreamerSender:
    """webrtcbin 1.22 does not follow the link: its bit rate is the ceiling that ours has by default."""

    def __init__(self, size: tuple[int, int]) -> None:
        self._size = size
        self._gi = binding()
        self._pipeline: Any = None
        self._source: Any = None

    async def answer(self, offer_sdp: str) -> str:
        return await asyncio.to_thread(self._answered, offer_sdp)

    def _answered(self, offer_sdp: str) -> str:
        payload_type = vp8_of(offer_sdp)
        pictures = encoded(self._size, default_ceiling_bps(*self._size), payload_type)
        self._pipeline = self._gi.Gst.parse_launch(f"{pictures} ! {sent(payload_type, 'peer')}")
        self._source, peer = (self._pipeline.get_by_name(name) for name in ("source", "peer"))
        self._pipeline.set_state(self._gi.Gst.State.PLAYING)
        return answered(self._gi, peer, offer_sdp)

    def post(self, image: Image, captured_at_s: float) -> None:
        push(self._gi, self._source, image)

    async def close(self) -> None:
        self._pipeline.set_state(self._gi.Gst.State.NULL)
