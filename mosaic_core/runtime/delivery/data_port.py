"""Reads and writes one open data channel of one peer: the frame of our own operators, or the bare payload of original
ones."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from itertools import chain

from mosaic_core.contract.host import Outgoing
from mosaic_core.machines.commands.command_order import ArrivalBaseline, CommandOrder
from mosaic_core.machines.delivery.framing import (
    HEADER_BYTES,
    SENT_CHUNK_BYTES,
    SEQ_MODULUS,
    Frame,
    FrameFlag,
    FrameReader,
    PayloadKind,
    encode_frame,
)
from mosaic_core.machines.delivery.reassembly import MAX_MESSAGE_BYTES, Partials
from mosaic_core.machines.delivery.send_scheduler import QueuedMessage
from mosaic_core.machines.delivery.shared_budget import SharedBudget
from mosaic_core.runtime.timing.deadline_timer import DeadlineTimer
from mosaic_core.runtime.transport.transport import Channel
from mosaic_core.words.control import CHANNEL_PROTOCOL
from mosaic_core.words.errors import WireError


def _bare(message: Outgoing) -> Iterator[bytes | str]:
    if message.original_text is not None:
        yield message.original_text()
        return
    for payload in (message.payload, *message.followers):
        yield payload if message.kind is PayloadKind.BYTES else payload.decode()


class DataPort:
    """Numbers and frames what goes out, reads what comes in. Event loop only."""

    def __init__(
        self,
        channel: Channel,
        baseline: ArrivalBaseline,
        max_message_bytes: int = MAX_MESSAGE_BYTES,
        partials: Partials | None = None,
    ) -> None:
        self.channel = channel
        self.is_framed = channel.protocol == CHANNEL_PROTOCOL
        self.reader = FrameReader(max_message_bytes, is_lossy=not channel.is_reliable, partials=partials)
        self._baseline = baseline
        self._order = CommandOrder(baseline)
        self._seq = 0

    def outgoing(self, message: Outgoing, flags: FrameFlag = FrameFlag.NONE, seq: int | None = None) -> QueuedMessage:
        """What goes over the wire for ``message``. ``seq``: its number where numbers outlive the connection."""
        payloads = (message.payload, *message.followers)
        size = message.size_bytes
        if not self.is_framed:
            return QueuedMessage(self.channel.label, _bare(message), size)
        if seq is not None:
            self._seq = (seq - 1) % SEQ_MODULUS
        frames = [self._framed(message, payload, flags) for payload in payloads]
        pieces = chain.from_iterable(encode_frame(frame, SENT_CHUNK_BYTES) for frame in frames)
        return QueuedMessage(self.channel.label, pieces, size + HEADER_BYTES * len(frames))

    def _framed(self, message: Outgoing, payload: bytes, flags: FrameFlag) -> Frame:
        self._seq = (self._seq + 1) % SEQ_MODULUS
        return Frame(message.kind, payload, seq=self._seq, stamp_us=message.stamp_us, flags=flags)

    def incoming(self, data: bytes | str) -> Frame | None:
        """The message that ``data`` completes; raises :class:`WireError`. Bare payloads have ``seq`` 0."""
        if not self.is_framed:
            return Frame(PayloadKind.BYTES, data.encode() if isinstance(data, str) else data)
        if isinstance(data, str):
            raise WireError("frame: text on a framed channel")
        return self.reader.read(data, time.monotonic())

    def order_of(self, frame: Frame, now_s: float) -> tuple[float, bool]:
        """The age of a message that has arrived, and whether it is newer than all before it. Of what came without a
        frame nothing is known."""
        return self._order.arrived(frame.seq, frame.stamp_us, now_s) if self.is_framed else (0.0, True)

    def observe(self, frame: Frame) -> None:
        """A message that isn't gated still tells how fast messages of this peer can be."""
        if self.is_framed:
            self._baseline.age_s(frame.stamp_us, time.monotonic())


_SLACK_S = 0.05
"""Clocks of event loops are coarse."""


class PeerPartials:
    """Bounds and forgets what one peer has sent in part. Event loop only. ``forgotten(label, seq)``: the rest of this
    message is not waited for any more; ``budget``: what all peers of the robot may keep."""

    def __init__(self, forgotten: Callable[[str, int], None], budget: SharedBudget | None = None) -> None:
        self.shared = Partials(budget=budget)
        self._readers: dict[str, FrameReader] = {}
        self._forgotten = forgotten
        self._timer = DeadlineTimer(self._expire)

    def opened(self, label: str, reader: FrameReader) -> None:
        self._readers[label] = reader

    def closed(self, labels: Iterable[str]) -> None:
        """Parts on channels that are gone will never be whole."""
        for label in labels:
            reader = self._readers.pop(label, None)
            if reader is not None:
                reader.chunks.close()
        self._watch_expiry()

    def arrived(self) -> None:
        """A channel has read something that was no whole message."""
        self._tell()
        if not self._timer.is_set:
            self._watch_expiry()

    def _tell(self) -> None:
        for label, reader in tuple(self._readers.items()):
            for seq in reader.chunks.take_forgotten():
                self._forgotten(label, seq)

    def _watch_expiry(self) -> None:
        expiry_s = self.shared.next_expiry_s
        self._timer.set(None if expiry_s is None else expiry_s + _SLACK_S)

    def _expire(self) -> None:
        self.shared.expire(time.monotonic())
        self._tell()
        self._watch_expiry()
