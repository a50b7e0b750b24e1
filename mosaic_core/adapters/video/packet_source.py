"""Packets that a handler yields already encoded: recognised, passed on, decoded only for those who need pictures."""

from __future__ import annotations

import logging
from collections import deque
from dataclasses import dataclass, replace
from typing import Any, cast

import av
from av.video.codeccontext import VideoCodecContext

from mosaic_core.adapters.video.picture import prepared_picture
from mosaic_core.adapters.video.video_encoder import CodecName
from mosaic_core.contract.media import PacketCodec
from mosaic_core.machines.media.annex_b import AnnexB, has_start_code, is_key_frame

_log = logging.getLogger(__name__)

_SENDABLE: dict[str, CodecName] = {"h264": "H264", "vp8": "VP8"}
_WINDOW_TICKS = 2 * 90_000
_RATE_STEP = 1.5
"""A source's bit rate is told anew when it changed by this factor."""
_BACK_BELOW = 0.8
"""Of the ceiling: a source whose rate varies around it is not encoded anew every other second."""
_PATIENCE = 150
"""So many packets in a row without a key frame, or without a picture, have a cause that somebody should hear of: at 30
per second an operator has waited for five seconds."""
_CURE = (
    "yield the demuxer's own packets, whose stream names their codec; for packets of an encoder of yours set "
    "packet_codec, h264 or vp8; decode anything else and yield its pictures"
)


@dataclass(frozen=True, slots=True)
class SourceState:
    """The kind of packets that a source sends: ``sendable_as`` a negotiable codec or ``None``; ``bitrate_bps`` roughly,
    0 at first. ``is_within_ceiling``: its true rate is known to be no more than one operator may be sent."""

    sendable_as: CodecName | None
    bitrate_bps: int = 0
    is_decodable: bool = True
    is_within_ceiling: bool = True


class PassedPackets:
    """Passes on the packets of one camera, on its handler's thread. ``unnamed``: the codec of a packet that belongs to
    no stream.
    """

    def __init__(self, label: str, unnamed: PacketCodec = "h264", ceiling_bps: int | None = None) -> None:
        self._label = label
        self._unnamed = unnamed
        self._ceiling_bps = ceiling_bps
        self._codec: tuple[str, bytes] = ("", b"")
        self._units: AnnexB | None = None
        self._decoder: VideoCodecContext | None = None
        self._sizes: deque[tuple[int, int]] = deque()
        self._without_key = self._without_picture = 0
        self._is_told_of_keys = False
        self._error = ""
        self.state = SourceState(None)

    def taken(self, packet: av.Packet[Any]) -> av.Packet[Any]:
        """The packet as it can be passed on. ``packet`` is stamped with its capture time.

        Raises :class:`TypeError` for what is no picture, or H.264 in a form that nobody can decode.
        """
        # Of the stream only the codec context: the rest of it is gone when its container is closed.
        context = None if packet.stream is None else packet.stream.codec_context
        codec = (self._unnamed, b"") if context is None else (str(context.name), context.extradata or b"")
        if codec != self._codec:
            self._recognise(packet, codec, context)
        if context is None and not packet.is_keyframe:
            packet.is_keyframe = _is_key(codec[0], bytes(packet))
        if self._units is not None:
            packet = _with_units(self._units, packet)
        self._measure(packet)
        self._watch_key_frames(packet)
        return packet

    def pictures(self, packet: av.Packet[Any]) -> list[av.VideoFrame]:
        """Its pictures, prepared, with their capture times; from a key frame on."""
        if not self.state.is_decodable:
            return []
        self._without_picture += 1
        decoded = self._decoded(packet) if self._decoder is not None or packet.is_keyframe else []
        if decoded:
            self._without_picture = 0
        elif self._without_picture == _PATIENCE and self._error:
            _log.warning("%s: no picture in %d packets of %s: %s", self._label, _PATIENCE, self._codec[0], self._error)
        return [prepared_picture(frame, (frame.pts or 0) / 90_000) for frame in decoded]

    def rest(self) -> None:
        """Nobody needs pictures: the decoder starts over when somebody does."""
        self._decoder = None

    def _recognise(self, packet: av.Packet[Any], codec: tuple[str, bytes], context: Any) -> None:
        name, codec_data = codec
        if context is not None and context.type != "video":
            raise TypeError(f"a packet of an {context.type} stream is no picture; take those of demux(video=0)")
        units = AnnexB(codec_data) if name == "h264" else None
        if units is not None and not units.has_lengths and not has_start_code(bytes(packet)):
            what = "H.264" if context is not None else "a packet without a stream, which is taken for H.264,"
            raise TypeError(f"{what} must begin with a start code (Annex B): {_CURE}")
        self._codec, self._units, self._decoder = codec, units if codec_data else None, None
        self._sizes.clear()
        self._without_key = self._without_picture = 0
        self._is_told_of_keys = False
        self._error = ""
        # Pictures that refer to later ones would be shown late, and in the wrong order.
        is_in_order = context is None or not context.has_b_frames
        self.state = SourceState(_SENDABLE.get(name) if is_in_order else None, 0, True, self._ceiling_bps is None)

    def _decoded(self, packet: av.Packet[Any]) -> list[av.VideoFrame]:
        try:
            if self._decoder is None:
                self._decoder = self._opened()
            return self._decoder.decode(packet)
        except av.FFmpegError as error:
            _log.debug("%s: a packet can't be decoded: %s", self._label, error)
            self._error = str(error)
            self._decoder = None
        except ValueError as error:
            _log.warning("%s: its codec %s can't be decoded here: %s", self._label, self._codec[0], error)
            self.state = replace(self.state, is_decodable=False)
        return []

    def _watch_key_frames(self, packet: av.Packet[Any]) -> None:
        self._without_key = 0 if packet.is_keyframe else self._without_key + 1
        if self._without_key == _PATIENCE and not self._is_told_of_keys:
            self._is_told_of_keys = True
            _log.warning(
                "%s: no key frame in %d packets, and who joins sees nothing before one; have its encoder make one "
                "every second or two",
                self._label,
                _PATIENCE,
            )

    def _measure(self, packet: av.Packet[Any]) -> None:
        pts = packet.pts or 0
        self._sizes.append((pts, packet.size))
        while self._sizes[0][0] < pts - _WINDOW_TICKS:
            self._sizes.popleft()
        ticks = pts - self._sizes[0][0]
        if ticks < _WINDOW_TICKS // 2:
            return
        # Without the newest, which belongs to the time after it, and may be a second key frame in one second.
        bitrate_bps = round((sum(size for _, size in self._sizes) - packet.size) * 8 * 90_000 / ticks)
        told_bps = self.state.bitrate_bps
        if not told_bps / _RATE_STEP <= bitrate_bps <= told_bps * _RATE_STEP:
            self.state = replace(self.state, bitrate_bps=bitrate_bps)
        if self._ceiling_bps is not None:
            most_bps = self._ceiling_bps * (1 if self.state.is_within_ceiling or not told_bps else _BACK_BELOW)
            if (bitrate_bps <= most_bps) != self.state.is_within_ceiling:
                self.state = replace(self.state, bitrate_bps=bitrate_bps, is_within_ceiling=bitrate_bps <= most_bps)

    def _opened(self) -> VideoCodecContext:
        """Raises :class:`ValueError` for a codec that this build does not decode."""
        name, codec_data = self._codec
        context = cast(VideoCodecContext, av.CodecContext.create(name, "r"))
        if self._units is None and codec_data:
            context.extradata = codec_data
        context.thread_count = 1  # several would hold pictures back
        context.options = {"flags": "low_delay"}
        return context


def _is_key(codec: str, data: bytes) -> bool:
    if codec == "h264":
        return is_key_frame(data)
    return bool(data) and not data[0] & 1  # RFC 6386, section 9.1


def _with_units(units: AnnexB, packet: av.Packet[Any]) -> av.Packet[Any]:
    """A packet of its own, because the handler may go on using its one."""
    data = bytes(packet)
    whole = units.of(data, is_key=packet.is_keyframe)
    if whole is data:
        return packet
    made: av.Packet[Any] = av.Packet(whole)
    made.pts, made.dts, made.time_base = packet.pts, packet.dts, packet.time_base
    made.is_keyframe = packet.is_keyframe
    return made
