"""Which sources may hold encoded pictures, judged by their names: without opening them and without importing PyAV."""

from __future__ import annotations

from pathlib import PurePosixPath
from urllib.parse import urlsplit

_CONTAINERS = {".mp4", ".m4v", ".mov", ".mkv", ".ts", ".m2ts", ".flv", ".h264", ".264", ".m3u8"}
_STREAM_SCHEMES = {"rtsp", "rtsps", "rtmp", "srt"}


def may_have_packets(source: str) -> bool:
    """Whether it is worth looking for H.264: not in a device, nor in a web camera's series of JPEGs."""
    parts = urlsplit(source)
    return parts.scheme in _STREAM_SCHEMES or PurePosixPath(parts.path or source).suffix.lower() in _CONTAINERS
