"""What waits in SCTP's queue, which aiortc keeps to itself."""

from __future__ import annotations

from collections.abc import Callable

from aiortc.rtcsctptransport import RTCSctpTransport


class SctpQueue:
    """What waits in SCTP's queues of one peer connection, and the moments when it gets less."""

    def __init__(self, sctp: RTCSctpTransport, on_progress: Callable[[], None]) -> None:
        self._sctp = sctp
        self._on_progress = on_progress
        self._flush = sctp._data_channel_flush
        sctp._data_channel_flush = self._flush_and_tell  # type: ignore[method-assign]

    @property
    def queued_bytes(self) -> int:
        """Bytes not yet handed to the network: messages that wait for SCTP and chunks that wait for its window."""
        messages = sum(len(data) for _, _, data in self._sctp._data_channel_queue)
        return messages + sum(len(chunk.user_data) for chunk in self._sctp._outbound_queue)

    async def _flush_and_tell(self) -> None:
        await self._flush()
        self._on_progress()
