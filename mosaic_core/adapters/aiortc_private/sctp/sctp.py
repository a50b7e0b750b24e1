"""Measures what waits in SCTP's queue, which aiortc keeps to itself."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TypeVar

from aiortc.rtcsctptransport import RTCSctpTransport

from mosaic_core.machines.congestion.background_rate import BackgroundRate

T = TypeVar("T")


class MeasuredQueue(deque[T]):
    """A queue that knows how many bytes wait in it, where aiortc would have to add them up.

    ``size_of`` tells the bytes of one entry. What else aiortc does to its queues leaves their entries alone.
    """

    def __init__(self, size_of: Callable[[T], int]) -> None:
        super().__init__()
        self.size_bytes = 0
        self._size_of = size_of

    def append(self, entry: T) -> None:
        self.size_bytes += self._size_of(entry)
        super().append(entry)

    def popleft(self) -> T:
        entry = super().popleft()
        self.size_bytes -= self._size_of(entry)
        return entry


class SctpQueue:
    """Measures what waits in SCTP's queues of one peer connection, and tells when it gets less."""

    def __init__(
        self,
        sctp: RTCSctpTransport,
        on_progress: Callable[[], None],
        on_left: Callable[[int], None] | None = None,
    ) -> None:
        """``on_left`` is told the size of every packet that does not give way."""
        self._sctp = sctp
        self._on_progress = on_progress
        if hasattr(sctp, "data_left"):  # aiortc's own SCTP doesn't tell
            sctp.data_left = on_left
        sctp._data_channel_flush = self._flush_and_tell  # type: ignore[method-assign]

    @property
    def queued_bytes(self) -> int:
        """Bytes not yet handed to the network: messages that wait for SCTP and chunks that wait for its window."""
        messages, chunks = self._sctp._data_channel_queue, self._sctp._outbound_queue
        if isinstance(messages, MeasuredQueue) and isinstance(chunks, MeasuredQueue):
            return messages.size_bytes + chunks.size_bytes
        return sum(len(data) for _, _, data in messages) + sum(len(chunk.user_data) for chunk in chunks)

    @property
    def window_bytes(self) -> int:
        """What may be on its way at present."""
        return self._sctp._cwnd

    @property
    def under_way_bytes(self) -> int:
        """Handed to the network, and not acknowledged yet."""
        return self._sctp._flight_size

    def give_way(self, on: bool, rate: BackgroundRate | None) -> None:
        """Let others have the path, and send no faster than at ``rate``; aiortc's own SCTP knows no such thing."""
        if hasattr(self._sctp, "gives_way") and hasattr(self._sctp, "background"):
            self._sctp.gives_way = on
            self._sctp.background = rate or BackgroundRate()

    async def _flush_and_tell(self) -> None:
        await type(self._sctp)._data_channel_flush(self._sctp)  # whatever it has become since
        self._on_progress()
