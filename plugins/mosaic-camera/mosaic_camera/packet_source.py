"""Sources whose H.264 is passed on as it is: network cameras, video files and USB cameras that encode, without decoding
and encoding again.
"""

from __future__ import annotations

import time
from typing import Any

import av

from mosaic_camera.grabbed import Grabbed, Takes, WantedSource, capture_time_s, takes_all
from mosaic_camera.source_error import SourceError

NETWORK_TIMEOUT_S = 5.0
REASON_TIMEOUT_S = 1.0
"""A camera that was just waited for in vain."""
_NETWORK_OPTIONS = {"rtsp_transport": "tcp", "analyzeduration": "500000"}
"""TCP, because a packet lost on the way from the camera can't be asked for again by the operator. Half a second (in µs)
is enough to see what a stream holds."""


def open_packets(source: str) -> PacketSource | None:
    """``source``, if it holds H.264 that a browser can take as it is; ``None`` if it must be decoded.

    Raises :class:`SourceError` if it is gone. May block for seconds.
    """
    is_network = "://" in source and not source.startswith("file://")
    options = _NETWORK_OPTIONS if is_network else {}
    timeout = (NETWORK_TIMEOUT_S, NETWORK_TIMEOUT_S) if is_network else None
    try:
        container = av.open(source.removeprefix("file://"), options=options, timeout=timeout)
    except (av.FFmpegError, OSError, ValueError):
        return None  # whoever opens it next, to decode it, knows the right words
    stream = next(iter(container.streams.video), None)
    if stream is None or stream.codec_context.name != "h264" or stream.codec_context.has_b_frames:
        # Pictures that refer to later ones would be shown late, and browsers don't take them from a live stream.
        container.close()
        return None
    return PacketSource(container, stream, is_live=is_network and not stream.duration and not container.duration)


def why_not(url: str) -> str:
    """The reason why nothing comes from there; nothing where it opens by now, or nobody knows. May block for
    seconds."""
    try:
        av.open(url, options=_NETWORK_OPTIONS, timeout=(REASON_TIMEOUT_S, REASON_TIMEOUT_S)).close()
    except (av.FFmpegError, OSError, ValueError) as error:
        return getattr(error, "strerror", None) or ""
    return ""


def open_device_packets(path: str, wanted: WantedSource) -> PacketSource | None:
    """The H.264 that a camera of this machine makes itself (USB Video Class 1.5 and the like), in the mode that is
    nearest to what is wanted; ``None`` if it makes none."""
    options = {"input_format": "h264"}
    if wanted.width and wanted.height:
        options["video_size"] = f"{wanted.width}x{wanted.height}"
    if wanted.fps:
        options["framerate"] = f"{wanted.fps:g}"
    try:
        container = av.open(path, format="v4l2", options=options)
    except (av.FFmpegError, OSError, ValueError):
        return None
    stream = next(iter(container.streams.video), None)
    if stream is None or stream.codec_context.name != "h264":
        container.close()
        return None
    return PacketSource(container, stream, is_live=True)


class PacketSource:
    """A :class:`~mosaic_camera.source.Source` whose pictures are packets as the demuxer gives them."""

    keeps_order = True

    def __init__(self, container: Any, stream: Any, *, is_live: bool) -> None:
        self._container = container
        self._stream = stream
        self._is_live = is_live
        self._packets = container.demux(stream)
        self._began_s: float | None = None
        self._position_s = 0.0
        self._turn_began_s = 0.0

    @property
    def is_live(self) -> bool:
        return self._is_live

    def read(self, takes: Takes = takes_all) -> Grabbed | None:
        try:
            packet = next(self._packets, None)
        except (av.FFmpegError, OSError) as error:
            raise SourceError(f"the stream broke off: {error}", "check cable, power and network") from error
        if packet is None or not packet.size:  # an empty one is the demuxer's sign that the recording is over
            return None
        if packet.pts is not None and packet.time_base is not None:
            stamp_s = float(packet.pts * packet.time_base)
            self._began_s = stamp_s if self._began_s is None else self._began_s
            self._position_s = self._turn_began_s + stamp_s - self._began_s
        now_s = time.monotonic()
        captured_at_s = capture_time_s(stamp_s, now_s) if self._is_live and packet.pts is not None else now_s
        return Grabbed(packet, captured_at_s, self._position_s, bool(packet.is_keyframe))

    def rewind(self) -> None:
        """Back to the first picture; positions go on rising."""
        self._turn_began_s = self._position_s + 1.0 / float(self._stream.average_rate or 30)
        self._began_s = None
        self._container.seek(0)
        self._packets = self._container.demux(self._stream)

    def close(self) -> None:
        self._container.close()
