"""Packets that a handler yields already encoded: recognised, passed on, decoded only for those who need pictures."""

from __future__ import annotations

import logging
from collections import deque
from dataclasses import dataclass, replace
from typing import Any, cast

import av
from av.video.codeccontext import VideoCodecContext

from mosaic_core.adapters.picture import prepared_picture
from mosaic_core.adapters.video_encoder import CodecName

_log = logging.getLogger(__name__)

_SENDABLE: dict[str, CodecName] = {"h264": "H264", "vp8": "VP8"}
_UNNAMED = "h264"
"""The codec of a packet that belongs to no stream."""
_WINDOW_TICKS = 2 * 90_000
_RATE_STEP = 1.5
"""A source's bit rate is told anew when it changed by this factor."""
_IDR = 5


@dataclass(frozen=True, slots=True)
class SourceState:
    """What the packets are: ``sendable_as`` a negotiable codec or ``None``; ``bitrate_bps`` roughly, 0 at first."""

    sendable_as: CodecName | None
    bitrate_bps: int = 0
    is_decodable: bool = True


class PacketSource:
    """Of one camera; used on its handler's thread."""

    def __init__(self, label: str) -> None:
        self._label = label
        self._codec_name = ""
        self._decoder: VideoCodecContext | None = None
        self._sizes: deque[tuple[int, int]] = deque()
        self.state = SourceState(None)

    def take(self, packet: av.Packet[Any]) -> None:
        """See what it is. ``packet`` is stamped with its capture time."""
        stream = packet.stream
        name = _UNNAMED if stream is None else str(stream.codec_context.name)
        if name != self._codec_name:
            self._codec_name = name
            self._decoder = None
            self._sizes.clear()
            self.state = SourceState(_SENDABLE.get(name))
        if stream is None and not packet.is_keyframe:
            packet.is_keyframe = is_h264_key_frame(bytes(packet))
        self._measure(packet)

    def pictures(self, packet: av.Packet[Any]) -> list[av.VideoFrame]:
        """Its pictures, prepared, with their capture times; from a key frame on."""
        if not self.state.is_decodable or (self._decoder is None and not packet.is_keyframe):
            return []
        try:
            if self._decoder is None:
                self._decoder = self._opened(packet)
            decoded = self._decoder.decode(packet)
        except av.FFmpegError as error:
            _log.debug("%s: a packet can't be decoded: %s", self._label, error)
            self._decoder = None
            return []
        except ValueError as error:
            _log.warning("%s: its codec %s can't be decoded here: %s", self._label, self._codec_name, error)
            self.state = replace(self.state, is_decodable=False)
            return []
        return [cast(av.VideoFrame, prepared_picture(frame, (frame.pts or 0) / 90_000)) for frame in decoded]

    def rest(self) -> None:
        """Nobody needs pictures: the decoder starts over when somebody does."""
        self._decoder = None

    def _measure(self, packet: av.Packet[Any]) -> None:
        pts = packet.pts or 0
        self._sizes.append((pts, packet.size))
        while self._sizes[0][0] < pts - _WINDOW_TICKS:
            self._sizes.popleft()
        ticks = pts - self._sizes[0][0]
        if ticks < _WINDOW_TICKS // 2:
            return
        bitrate_bps = round(sum(size for _, size in self._sizes) * 8 * 90_000 / ticks)
        told_bps = self.state.bitrate_bps
        if not told_bps / _RATE_STEP <= bitrate_bps <= told_bps * _RATE_STEP:
            self.state = replace(self.state, bitrate_bps=bitrate_bps)

    def _opened(self, packet: av.Packet[Any]) -> VideoCodecContext:
        """Raises :class:`ValueError` for a codec that this build does not decode."""
        context = cast(VideoCodecContext, av.CodecContext.create(self._codec_name, "r"))
        if packet.stream is not None and packet.stream.codec_context.extradata:
            context.extradata = packet.stream.codec_context.extradata
        context.thread_count = 1  # several would hold pictures back
        context.options = {"flags": "low_delay"}
        return context


def is_h264_key_frame(data: bytes) -> bool:
    """Whether H.264 with start codes holds a picture that needs no other one."""
    start = data.find(b"\x00\x00\x01")
    while start >= 0 and start + 3 < len(data):
        if data[start + 3] & 0x1F == _IDR:
            return True
        start = data.find(b"\x00\x00\x01", start + 3)
    return False
