"""The pictures of one remote track."""

from __future__ import annotations

from typing import Any

from aiortc import RTCRtpReceiver
from aiortc.mediastreams import MediaStreamError, MediaStreamTrack

from mosaic_core.adapters.aiortc_private.rtp.receivers import be_prompt, rtp_timestamp_of
from mosaic_core.machines.media.first_frame import ReceivedSoFar


class AiortcVideo:
    """The pictures that arrive on one track of aiortc; a ``runtime.transport.IncomingVideo``. Frames that nobody takes
    pile up in aiortc.
    """

    def __init__(self, track: MediaStreamTrack, receiver: RTCRtpReceiver | None) -> None:
        self._track = track
        self._receiver = receiver
        if receiver is not None:
            be_prompt(receiver)
        self._frames = 0

    async def next(self) -> Any:
        try:
            frame = await self._track.recv()
            self._frames += 1
            return frame
        except MediaStreamError:
            return None

    def rtp_timestamp(self, frame: Any) -> int | None:
        return None if self._receiver is None else rtp_timestamp_of(self._receiver, frame)

    async def received(self) -> ReceivedSoFar | None:
        """From the receiver's own statistics and the sender's reports."""
        if self._receiver is None:
            return None
        report = await self._receiver.getStats()
        inbound = next((one for one in report.values() if one.type == "inbound-rtp"), None)
        told = next((one for one in report.values() if one.type == "remote-outbound-rtp"), None)
        packets = 0 if inbound is None else inbound.packetsReceived
        return ReceivedSoFar(packets, self._frames, None if told is None else told.packetsSent)

    def stop(self) -> None:
        self._track.stop()
