"""A track waits for its feed, keeps time going forward, and learns where RTP time begins."""

from __future__ import annotations

import asyncio
import logging
from types import SimpleNamespace
from typing import Any, cast

import av
import numpy as np
import pytest
from aiortc import RTCRtpSender
from aiortc.mediastreams import MediaStreamError

from mosaic_core.adapters.picture import prepared_picture, pts_of
from mosaic_core.adapters.video_track import VideoTrack


class Feed:
    def __init__(self, *times_s: float) -> None:
        self.pictures = [prepared_picture(np.zeros((4, 4), np.uint8), time_s) for time_s in times_s]

    async def next(self) -> Any:
        if not self.pictures:
            await asyncio.Event().wait()
        return self.pictures.pop(0)


def sender_at(timestamp: int) -> Any:
    return SimpleNamespace(_RTCRtpSender__rtp_timestamp=timestamp)


def track_of(feed: Feed, sender: Any, origins: list[int] | None = None) -> VideoTrack:
    return VideoTrack("front", feed, cast(RTCRtpSender, sender), (origins if origins is not None else []).append)


def test_its_id_is_the_label() -> None:
    async def run() -> None:
        track = track_of(Feed(), sender_at(0))
        assert (track.id, track.kind) == ("front", "video")

    asyncio.run(run())


def test_a_picture_that_is_not_newer_is_left_out_and_reported_once(caplog: pytest.LogCaptureFixture) -> None:
    async def run() -> None:
        track = track_of(Feed(2.0, 2.0, 1.0, 3.0), sender_at(0))
        with caplog.at_level(logging.WARNING):
            assert (await track.recv()).pts == pts_of(2.0)
            assert (await track.recv()).pts == pts_of(3.0)
        assert len([record for record in caplog.records if "front" in record.message]) == 1

    asyncio.run(run())


def test_the_origin_is_told_once_when_the_first_picture_has_left() -> None:
    async def run() -> None:
        origins: list[int] = []
        sender = sender_at(0)
        track = track_of(Feed(1.0, 2.0, 3.0, 4.0), sender, origins)
        first = await track.recv()
        await track.recv()  # the encoder swallowed the first picture: nothing was sent
        assert origins == []
        sender._RTCRtpSender__rtp_timestamp = (pts_of(2.0) + 4_294_000_000) % (1 << 32)
        await track.recv()
        await track.recv()
        assert origins == [4_294_000_000]
        assert isinstance(first, av.VideoFrame)

    asyncio.run(run())


def test_a_stopped_track_ends() -> None:
    async def run() -> None:
        track = track_of(Feed(1.0), sender_at(0))
        track.stop()
        with pytest.raises(MediaStreamError):
            await track.recv()

    asyncio.run(run())
