"""The pictures of one remote track."""

from __future__ import annotations

from typing import Any

from aiortc import RTCRtpReceiver
from aiortc.mediastreams import MediaStreamError, MediaStreamTrack

from mosaic_core.adapters.aiortc_private.receivers import rtp_timestamp_of


class IncomingVideo:
    """Implements ``runtime.operator_transport.IncomingVideo``; frames that nobody takes pile up in aiortc."""

    def __init__(self, track: MediaStreamTrack, receiver: RTCRtpReceiver | None) -> None:
        self._track = track
        self._receiver = receiver

    async def next(self) -> Any:
        try:
            return await self._track.recv()
        except MediaStreamError:
            return None

    def rtp_timestamp(self, frame: Any) -> int | None:
        return None if self._receiver is None else rtp_timestamp_of(self._receiver, frame)

    def stop(self) -> None:
        self._track.stop()
