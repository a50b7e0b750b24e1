"""Sends and receives on one data channel of the operator: framed toward a robot of ours, bare toward an original
one."""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from pydantic import ValidationError

from mosaic_core.machines.delivery.arrivals import Arrivals
from mosaic_core.machines.delivery.framing import SEQ_MODULUS, Frame, FrameFlag, FrameReader, PayloadKind, encode_frame
from mosaic_core.messages import STANDARD_MESSAGES, StandardMessage
from mosaic_core.operator.delivery.store_counters import StoreCounters
from mosaic_core.runtime.delivery.data_port import PeerPartials
from mosaic_core.runtime.transport.transport import Channel
from mosaic_core.words.control import CHANNEL_PROTOCOL
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.errors import ConnectionFailed, WireError

_log = logging.getLogger(__name__)

MAX_QUEUED_BYTES = 64 * 1024
"""More than this in SCTP's queue makes commands late; what else is there to send must wait or be told no."""


@dataclass(frozen=True, slots=True)
class MessageInfo:
    """The facts that came with a message. ``seq`` and ``stamp_us`` (the robot's clock) are 0 from original robots, and
    ``is_latched`` marks the last value, repeated for those who came later. ``to_ours_us`` maps the robot's clock to
    ours, by what is known now of the connection on which it came. ``schema_id`` is what it should be, by the robot's
    catalogue."""

    received_at_s: float
    seq: int = 0
    stamp_us: int = 0
    is_latched: bool = False
    to_ours_us: Callable[[int], int | None] = field(default=lambda _: None, repr=False, compare=False)
    schema_id: str = ""

    @property
    def age_s(self) -> float | None:
        """How old it was when it came. ``None`` while the clocks are not known: before the first pong, and always from
        original robots."""
        made_us = self.to_ours_us(self.stamp_us) if self.stamp_us else None
        return None if made_us is None else max(0.0, self.received_at_s - made_us / 1e6)


@dataclass(frozen=True, slots=True)
class Received:
    """A message from the robot."""

    data: bytes
    info: MessageInfo

    def text(self) -> str:
        """The payload as text; raises :class:`UnicodeDecodeError`."""
        return self.data.decode()

    def json(self) -> Any:
        """The payload as JSON; raises :class:`ValueError`."""
        return json.loads(self.data)

    def message(self) -> StandardMessage | None:
        """It as the standard message that the robot announced; ``None`` where it announced none that is known here.
        Raises :class:`WireError` where it is none."""
        kind = STANDARD_MESSAGES.get(self.info.schema_id)
        try:
            return None if kind is None else kind.model_validate_json(self.data)
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(map(str, first["loc"]))
            raise WireError(f"no {self.info.schema_id}: {place} {first['msg']}") from error


def now_us() -> int:
    """This program's monotonic clock."""
    return time.monotonic_ns() // 1000


def no_epoch() -> int:
    """The epoch of what needs no lease."""
    return 0


class DataPort:
    """The operator's end of a connector's data channel. Event loop only. ``received`` gets whole messages; ``changed``
    is called when the channel opens or closes.

    ``epoch`` is read when a message is made, as is the clock: one that has to wait gets neither younger nor a newer
    lease than it was made under. ``max_queued_bytes`` of ``None``: this channel's few words go in whatever waits.
    """

    def __init__(
        self,
        channel: Channel,
        delivery: Delivery,
        received: Callable[[Frame], None],
        changed: Callable[[bool], None],
        *,
        clock_us: Callable[[], int] = now_us,
        epoch: Callable[[], int] = no_epoch,
        max_queued_bytes: int | None = MAX_QUEUED_BYTES,
        counters: StoreCounters | None = None,
        partials: PeerPartials | None = None,
    ) -> None:
        self._channel = channel
        self._delivery = delivery
        self._received = received
        self._changed = changed
        self._clock_us = clock_us
        self._epoch = epoch
        self._max_queued_bytes = max_queued_bytes
        self._is_framed = channel.protocol == CHANNEL_PROTOCOL
        self._counters = counters or StoreCounters()
        self._partials = partials or PeerPartials(lambda label, seq: None)
        self._reader = FrameReader(is_lossy=not channel.is_reliable, partials=self._partials.shared)
        self._partials.opened(channel.label, self._reader)
        self._arrivals = Arrivals(self._counters.arrivals, newest_only=delivery is Delivery.LATEST)
        self._seq = 0
        self._pending: Frame | None = None
        self.on_drained: Callable[[], None] | None = None
        """Less waits below than before: :meth:`put` may be tried again."""
        channel.on_message = self._arrived
        channel.on_open = lambda: changed(True)
        channel.on_close = lambda: changed(False)
        channel.on_drained = self._drained

    @property
    def is_open(self) -> bool:
        return self._channel.is_open

    @property
    def has_arrived(self) -> bool:
        """The other side has acknowledged everything that was sent over the whole peer connection."""
        channel = self._channel
        return self._pending is None and channel.buffered_bytes == 0 and channel.under_way_bytes == 0

    def send(self, kind: PayloadKind, payload: bytes) -> bool:
        """Whether it was accepted. Under ``latest`` a message that can't leave yet waits, until a newer one comes.

        Each takes a number, also one that never leaves: the robot tells by the gap that this was no pause.
        """
        if not self._channel.is_open:
            return False
        self._seq = (self._seq + 1) % SEQ_MODULUS
        frame = replace(self.frame(kind, payload), seq=self._seq)
        if self._is_full:
            if self._delivery is not Delivery.LATEST:
                return False
            self._counters.replaced += self._pending is not None
            self._pending = frame
            return True
        self._counters.replaced += self._pending is not None
        self._pending = None
        return self._send_now(frame)

    def frame(self, kind: PayloadKind, payload: bytes) -> Frame:
        """A message made now, without a number."""
        return Frame(kind, payload, epoch=self._epoch(), stamp_us=self._clock_us())

    def put(self, frame: Frame) -> bool:
        """Send ``frame`` under its own number; ``False``: too much waits below, or the channel isn't open."""
        if not self._channel.is_open or self._is_full:
            return False
        self._seq = frame.seq
        return self._send_now(frame)

    @property
    def _is_full(self) -> bool:
        return self._max_queued_bytes is not None and self._channel.buffered_bytes >= self._max_queued_bytes

    def close(self) -> None:
        self._pending = None
        self._partials.closed((self._channel.label,))
        self._channel.on_close = None
        self._channel.close()

    def _send_now(self, frame: Frame) -> bool:
        try:
            if not self._is_framed:
                self._channel.send(frame.payload if frame.kind is PayloadKind.BYTES else frame.payload.decode())
            else:
                for part in encode_frame(frame):
                    self._channel.send(part)
        except ConnectionFailed as error:
            _log.info("%s", error.message)
            return False
        self._counters.gave(len(frame.payload))
        return True

    def _drained(self) -> None:
        if self._pending is not None and self._channel.is_open and not self._is_full:
            frame, self._pending = self._pending, None
            self._send_now(frame)
        if self.on_drained is not None:
            self.on_drained()

    def _arrived(self, data: bytes | str) -> None:
        raw = data.encode() if isinstance(data, str) else data
        if not self._is_framed:
            kind = PayloadKind.STRING if isinstance(data, str) else PayloadKind.BYTES
            self._counters.got(len(raw))
            self._received(Frame(kind, raw))
            return
        try:
            frame = self._reader.read(raw, time.monotonic())
        except WireError as error:
            _log.warning("%s: %s", self._channel.label, error.message)
            return
        if frame is None:
            self._partials.arrived()
            return
        self._counters.got(len(frame.payload))
        if self._arrivals.take(frame.seq):
            self._received(frame)


def info_of(frame: Frame, to_ours_us: Callable[[int], int | None], at_us: int, schema_id: str = "") -> MessageInfo:
    """What to tell a subscriber at ``at_us`` of our clock."""
    is_latched = bool(frame.flags & FrameFlag.LATCHED)
    return MessageInfo(at_us / 1e6, frame.seq, frame.stamp_us, is_latched, to_ours_us, schema_id)
