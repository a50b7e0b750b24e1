"""The pictures of one remote track."""

from __future__ import annotations

from typing import Any

from aiortc.mediastreams import MediaStreamError, MediaStreamTrack


class IncomingVideo:
    """Implements ``runtime.operator_transport.IncomingVideo``; frames that nobody takes pile up in aiortc."""

    def __init__(self, track: MediaStreamTrack) -> None:
        self._track = track

    async def next(self) -> Any:
        try:
            return await self._track.recv()
        except MediaStreamError:
            return None

    def stop(self) -> None:
        self._track.stop()
