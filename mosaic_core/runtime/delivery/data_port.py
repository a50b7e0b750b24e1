"""One open data channel of one peer: the frame of our own operators, or the bare payload of original ones."""

from __future__ import annotations

import time
from collections.abc import Iterator
from itertools import chain

from mosaic_core.contract.host import Outgoing
from mosaic_core.machines.commands.command_gate import ArrivalBaseline, CommandGate
from mosaic_core.machines.delivery.framing import (
    HEADER_BYTES,
    MAX_MESSAGE_BYTES,
    SENT_CHUNK_BYTES,
    SEQ_MODULUS,
    Frame,
    FrameFlag,
    FrameReader,
    PayloadKind,
    encode_frame,
)
from mosaic_core.machines.delivery.reassembly import Partials
from mosaic_core.machines.delivery.send_scheduler import QueuedMessage
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
        max_age_s: float | None,
        max_message_bytes: int = MAX_MESSAGE_BYTES,
        partials: Partials | None = None,
    ) -> None:
        self.channel = channel
        self.is_framed = channel.protocol == CHANNEL_PROTOCOL
        self.reader = FrameReader(max_message_bytes, is_lossy=not channel.is_reliable, partials=partials)
        self._baseline = baseline
        self._gate = CommandGate(baseline, max_age_s) if self.is_framed else None
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

    def refusal(self, frame: Frame) -> str | None:
        """The code if the command gate keeps this message out."""
        if self._gate is None:
            return None
        return self._gate.refusal(frame.seq, frame.stamp_us, time.monotonic())

    def observe(self, frame: Frame) -> None:
        """A message that isn't gated still tells how fast messages of this peer can be."""
        if self.is_framed:
            self._baseline.age_s(frame.stamp_us, time.monotonic())
