"""Carries out one peer's send scheduler: sends pieces while SCTP's own buffer is short, goes on when it drains."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable

from mosaic_core.contract.host import Loss
from mosaic_core.machines.delivery.send_scheduler import Offered, Priority, QueuedMessage, QueueLimits, SendScheduler
from mosaic_core.machines.timing.pacing import ComplaintPace
from mosaic_core.runtime.transport.transport import Channel
from mosaic_core.words.errors import ConnectionFailed

logger = logging.getLogger(__name__)

_PIECES_AT_ONCE = 64
"""After so many others on the event loop get their turn."""
_RETRY_S = 0.02
"""``on_drained`` is the rule; this catches a drain that happened just before the queue began to wait."""


class SendQueue:
    """Queues and sends all messages to one peer. Event loop only. ``has_room``: told when a channel that was full takes
    messages again. ``left_out``: told of messages that were taken and will not leave, beyond what :meth:`offer` says.
    """

    def __init__(
        self,
        has_room: Callable[[str], None],
        left_out: Callable[[str, Loss, int], None] = lambda label, reason, messages: None,
    ) -> None:
        self._loop = asyncio.get_running_loop()
        self._scheduler = SendScheduler()
        self._channels: dict[str, Channel] = {}
        self._priorities: dict[str, Priority] = {}
        self._full: set[str] = set()
        self._has_room = has_room
        self._left_out = left_out
        self._complaints = ComplaintPace()
        self._timer: asyncio.Handle | None = None
        self._is_pumping = False

    def open(self, channel: Channel, priority: Priority, limits: QueueLimits | None = None) -> None:
        self._channels[channel.label] = channel
        self._scheduler.open(channel.label, priority, limits)
        channel.on_drained = self.pump
        self._priorities[channel.label] = priority
        channel.give_way(set(self._priorities.values()) == {Priority.BULK})

    def close(self, label: str) -> None:
        self._channels.pop(label, None)
        self._priorities.pop(label, None)
        self._full.discard(label)
        self._scheduler.close(label)

    def close_all(self) -> None:
        for label in tuple(self._channels):
            self.close(label)
        if self._timer is not None:
            self._timer.cancel()

    def offer(self, message: QueuedMessage) -> Offered:
        """Queue and, where there is room below, send at once."""
        if message.channel not in self._channels:
            return Offered.REFUSED
        before = self._scheduler.counters.replaced
        offered = self._scheduler.offer(message)
        if offered is Offered.REFUSED:
            self._full.add(message.channel)
        more = self._scheduler.counters.replaced - before - 1
        if more > 0:  # a large message takes the place of several; of one the answer tells
            self._left_out(message.channel, "replaced", more)
        self.pump()
        return offered

    def waiting(self, label: str) -> tuple[int, int]:
        """``(messages, bytes)`` that wait for this channel."""
        return self._scheduler.waiting(label)

    @property
    def is_confirmed(self) -> bool:
        """Whether the other side has confirmed all that was offered."""
        channel = next(iter(self._channels.values()), None)
        return channel is None or (
            self._scheduler.is_idle and channel.buffered_bytes == 0 and channel.under_way_bytes == 0
        )

    def pump(self) -> None:
        """Send what may be sent now."""
        if self._is_pumping:  # a channel may report its drain from within send
            return
        self._is_pumping = True
        try:
            self._pump()
        finally:
            self._is_pumping = False

    def _pump(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        for _ in range(_PIECES_AT_ONCE):
            taken = self._scheduler.take(*self._below())
            if taken is None:
                break
            self._send(*taken)
        else:
            self._timer = self._loop.call_soon(self.pump)
        self._report_room()
        if self._timer is None and not self._scheduler.is_idle:
            self._timer = self._loop.call_later(_RETRY_S, self.pump)

    def _below(self) -> tuple[int, int | None]:
        """Buffer and window belong to the whole peer connection: any channel knows them."""
        channel = next(iter(self._channels.values()), None)
        return (channel.buffered_bytes, channel.window_bytes) if channel is not None else (0, None)

    def _send(self, label: str, piece: bytes | str) -> None:
        channel = self._channels[label]
        try:
            channel.send(piece)
        except ConnectionFailed as error:
            fields = {"label": label, "code": error.code}
            if error.code == "channel.too_large":  # a bare message, which can't be split, to an original operator
                self._left_out(label, "too_large", 1)
                if self._complaints.is_due(label, time.monotonic()):
                    logger.warning("%r: a message of %d bytes is left out: %s", label, len(piece), error, extra=fields)
                return
            logger.debug("channel %r is gone: %s", label, error, extra=fields)
            self.close(label)

    def _report_room(self) -> None:
        for label in [label for label in self._full if self._scheduler.has_room(label)]:
            self._full.discard(label)
            self._has_room(label)
