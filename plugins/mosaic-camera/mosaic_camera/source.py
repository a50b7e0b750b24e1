"""Opens the source of pictures: a device, a file or a URL, behind one small class over ``cv2.VideoCapture``.

OpenCV is used for all three: it takes a device's own capture time stamps, and it reads every container and stream
that FFmpeg reads. All methods belong to one thread (the grabber's).
"""

from __future__ import annotations

import logging
import os
import re
import time
from pathlib import Path, PurePosixPath
from typing import Any, Protocol
from urllib.parse import urlsplit

from mosaic_camera.devices import check_device, found_devices
from mosaic_camera.grabbed import Grabbed, Takes, WantedSource, capture_time_s, takes_all
from mosaic_camera.source_error import SourceError
from mosaic_core.words.errors import nearest

logger = logging.getLogger(__name__)

NETWORK_TIMEOUT_MS = 5000
"""For opening and for each read of a URL; OpenCV's own default is 30 s."""
FALLBACK_FPS = 30.0
_CONTAINERS = {".mp4", ".m4v", ".mov", ".mkv", ".ts", ".m2ts", ".flv", ".h264", ".264", ".m3u8"}
_STREAM_SCHEMES = {"rtsp", "rtsps", "rtmp", "srt", "tcp", "udp"}
_LOGIN = re.compile(r"(?<=://)(?:[^/\s:@]*:(?!\d+/)\S*|[^/\s]*)@")
"""Up to the last ``@`` before the path, and beyond a slash where a password seems to hold one: what was not escaped is
nobody's to read, either."""
_SCHEMES = {*_STREAM_SCHEMES, "http", "https", "file", "ftp", "mms", "mmsh", "rtmpe", "rtmps", "rtmpt", "rtp", "sftp"}


class Source(Protocol):
    """An open source."""

    @property
    def is_live(self) -> bool:
        """Live sources set the pace themselves; a recording waits for whoever reads it."""
        ...

    @property
    def keeps_order(self) -> bool:
        """Its pictures build on each other: none may be left out."""
        ...

    def read(self, takes: Takes = takes_all) -> Grabbed | None:
        """The next picture; blocks; ``None`` at the end of a recording or when a live source is lost. Where order is
        kept, every one is taken."""
        ...

    def rewind(self) -> None: ...
    def close(self) -> None: ...


def shown(source: int | str) -> str:
    """The source as messages may name it: without the password of a URL."""
    return _LOGIN.sub("", str(source))


def is_device(source: int | str) -> bool:
    """Whether this names a camera of this machine: a number or a path under /dev."""
    return str(source).isdecimal() or str(source).startswith("/dev/")


def may_have_packets(source: str) -> bool:
    """Whether it is worth looking for H.264, by the name alone: not in a device, nor in a web camera's series of
    JPEGs."""
    parts = urlsplit(source)
    return parts.scheme in _STREAM_SCHEMES or PurePosixPath(parts.path or source).suffix.lower() in _CONTAINERS


def open_source(wanted: WantedSource) -> Source:
    """Open what ``wanted.source`` names; raises :class:`SourceError`. May block for seconds."""
    text = str(wanted.source)
    if wanted.passes_packets and not is_device(text) and (packets := _packets_of(text)) is not None:
        return packets
    if is_device(text):
        path = Path(f"/dev/video{text}" if text.isdecimal() else text)
        check_device(path, found_devices())
        return (_device_packets(path, wanted) if wanted.passes_packets else None) or _opened_device(path, wanted)
    if "://" in text and not text.startswith("file://"):
        return _opened_url(text)
    return _opened_file(Path(text.removeprefix("file://")).expanduser())


def _packets_of(text: str) -> Source | None:
    if not may_have_packets(text):
        return None
    from mosaic_camera.packet_source import open_packets  # loads PyAV: only for who passes packets on

    return open_packets(text)


def _device_packets(path: Path, wanted: WantedSource) -> Source | None:
    from mosaic_camera.packet_source import open_device_packets  # loads PyAV, as above

    packets = open_device_packets(str(path), wanted)
    if packets is None:
        logger.warning(
            "%s makes no H.264 itself; its pictures are encoded here (`v4l2-ctl --list-formats` tells)", path
        )
    return packets


def _opened_device(path: Path, wanted: WantedSource) -> Source:
    import cv2

    capture = cv2.VideoCapture(str(path), cv2.CAP_V4L2)
    if not capture.isOpened():
        capture.release()
        raise SourceError(f"{path} does not open as a camera", "close the program that uses it (`fuser -v` names it)")
    # MJPG first: raw pictures of 720p do not fit through USB 2 at 30 per second. A camera without it keeps its own.
    capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*"MJPG"))
    for name, value in (
        (cv2.CAP_PROP_FRAME_WIDTH, wanted.width),
        (cv2.CAP_PROP_FRAME_HEIGHT, wanted.height),
        (cv2.CAP_PROP_FPS, wanted.fps),
        (cv2.CAP_PROP_BUFFERSIZE, 1),
    ):
        if value is not None:
            capture.set(name, value)
    _warn_of_other_size(path, wanted, capture.get(cv2.CAP_PROP_FRAME_WIDTH), capture.get(cv2.CAP_PROP_FRAME_HEIGHT))
    return CaptureSource(capture, is_live=True)


def _warn_of_other_size(path: Path, wanted: WantedSource, width: float, height: float) -> None:
    if (wanted.width or width) != width or (wanted.height or height) != height:
        logger.warning(
            "%s has no mode of %s x %s; it gives %d x %d (`v4l2-ctl --list-formats-ext` names its modes)",
            path, wanted.width, wanted.height, width, height,
        )  # fmt: skip


def _opened_url(url: str) -> Source:
    import cv2

    limits = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, NETWORK_TIMEOUT_MS, cv2.CAP_PROP_READ_TIMEOUT_MSEC, NETWORK_TIMEOUT_MS]
    capture = cv2.VideoCapture(url, cv2.CAP_FFMPEG, limits)
    if not capture.isOpened():
        capture.release()
        raise _not_opened(url)
    return CaptureSource(capture, is_live=capture.get(cv2.CAP_PROP_FRAME_COUNT) <= 0)


def meant_scheme(source: int | str) -> str | None:
    """What the scheme of an address was meant to be, where it is none that is known."""
    scheme, is_address, _ = str(source).partition("://")
    return nearest(scheme, _SCHEMES) if is_address and scheme.lower() not in _SCHEMES else None


def _not_opened(url: str) -> SourceError:
    """With the reason, which OpenCV keeps to itself."""
    from mosaic_camera.packet_source import why_not  # loads PyAV

    what = ": ".join(filter(None, (f"no video from {shown(url)}", why_not(url))))
    meant = meant_scheme(url)
    known = "check that the address, user and password play in `ffplay`"
    return SourceError(what, f"did you mean {meant}://?" if meant else known)


def _opened_file(path: Path) -> Source:
    import cv2

    if not path.is_file():
        raise SourceError(f"no such video file: {path.absolute()}", "set `source` to a file, a /dev/video* or a URL")
    if not os.access(path, os.R_OK):
        raise SourceError(f"no permission to read {path.absolute()}", "let this account read the file (`chmod`)")
    capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    if not capture.isOpened():
        capture.release()
        raise SourceError(f"{path.absolute()} is not a video that can be decoded", "check that it plays in `ffplay`")
    return CaptureSource(capture, is_live=False)


class CaptureSource:
    """A :class:`Source` over an open ``cv2.VideoCapture``."""

    keeps_order = False

    def __init__(self, capture: Any, *, is_live: bool) -> None:
        import cv2

        self._capture = capture
        self._position_property = cv2.CAP_PROP_POS_MSEC
        self._frame_property = cv2.CAP_PROP_POS_FRAMES
        self._period_s = 1.0 / _plausible_fps(capture.get(cv2.CAP_PROP_FPS))
        self._is_live = is_live
        self._position_s = -self._period_s
        self._turn_began_s = 0.0

    @property
    def is_live(self) -> bool:
        return self._is_live

    def read(self, takes: Takes = takes_all) -> Grabbed | None:
        if not self._capture.grab():
            return None
        now_s = time.monotonic()
        stamp_s = self._capture.get(self._position_property) / 1000.0
        if self._is_live:
            at_s = captured_at_s = capture_time_s(stamp_s, now_s)
            position_s = 0.0
        else:
            captured_at_s = now_s
            at_s = position_s = self._position_s = self._next_position_s(stamp_s)
        if not takes(at_s):  # a device's picture is decoded only when it is retrieved
            return Grabbed(None, captured_at_s, position_s)
        is_decoded, image = self._capture.retrieve()
        if not is_decoded or image is None:
            return Grabbed(None, captured_at_s, position_s, is_garbled=True)
        return Grabbed(image, captured_at_s, position_s)

    def rewind(self) -> None:
        """Back to the first picture; positions go on rising."""
        self._turn_began_s = self._position_s + self._period_s
        self._capture.set(self._frame_property, 0)

    def close(self) -> None:
        self._capture.release()

    def _next_position_s(self, stamp_s: float) -> float:
        """The file's own time stamp where it moves on, the frame rate where it does not (raw streams have none)."""
        position_s = self._turn_began_s + stamp_s
        return position_s if position_s > self._position_s else self._position_s + self._period_s


def _plausible_fps(fps: float) -> float:
    return fps if 0.1 <= fps <= 1000 else FALLBACK_FPS
