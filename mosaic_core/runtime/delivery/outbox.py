"""Hands messages from the handlers to the peers: who listens to which channel, what late joiners get, how much may go
out, and the way to the event loop.

``post`` runs on the handler's thread and never blocks: it looks at snapshots that the loop replaces as a whole.
"""

from __future__ import annotations

import asyncio
import logging
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Protocol

from mosaic_core.contract.host import Loss, Outgoing
from mosaic_core.machines.delivery.delivery_terms import DeliveryTerms
from mosaic_core.machines.delivery.reassembly import MAX_MESSAGE_BYTES
from mosaic_core.machines.delivery.send_scheduler import Offered
from mosaic_core.machines.timing.pacing import ComplaintPace, NewestThinning, TokenBucket
from mosaic_core.runtime.delivery.data_taps import DataTaps, TapReader
from mosaic_core.runtime.observation.counters import ConnectorCounters
from mosaic_core.runtime.threads.handover import Handover
from mosaic_core.runtime.timing.deadline_timer import DeadlineTimer

logger = logging.getLogger(__name__)


_MAX_PENDING_BYTES = 64 * 1024 * 1024
"""What handlers may have waiting for an event loop that stands still."""

_MAX_SUCCESSORS = 64
"""Peers whose session went on with another one, and who may still be answered."""


class Listener(Protocol):
    """A peer that has channels open. One that refuses says ``has_room`` to the outbox when it takes messages again."""

    def deliver(self, message: Outgoing) -> Offered: ...

    def waiting(self, channel: str) -> tuple[int, int]:
        """``(messages, bytes)`` that wait to go out there."""


class Audience(Protocol):
    """Hears what becomes of each one who listens to a channel; on the event loop."""

    def left(self, peer_id: str) -> None: ...
    def handed_over(self, peer_id: str, successor_id: str) -> None: ...


@dataclass(slots=True)
class _Channel:
    terms: DeliveryTerms
    counters: ConnectorCounters
    timer: DeadlineTimer
    """Sends what the thinner keeps back."""
    audience: Audience | None = None
    listeners: Mapping[str, Listener] = field(default_factory=dict)
    full: frozenset[str] = frozenset()
    """The peers that refused a message and have not said that they take more."""
    latched: Outgoing | None = None
    bucket: TokenBucket | None = None
    thinner: NewestThinning[Outgoing] | None = None

    def hearing(self, to: str | None) -> tuple[str, ...]:
        """The peers that a message is for."""
        return tuple(self.listeners) if to is None else (to,) if to in self.listeners else ()


class Outbox:
    """Distributes what the handlers of a robot send. ``heard_changed``: told on the loop when a channel gets its first
    or loses its last listener; a tap is one, too."""

    def __init__(self, loop: asyncio.AbstractEventLoop, heard_changed: Callable[[str, bool], None]) -> None:
        self.taps = DataTaps()
        self._loop = loop
        self._handover: Handover[Outgoing] = Handover(loop, self._arrived)
        self._heard_changed = heard_changed
        self._channels: dict[str, _Channel] = {}
        self._lock = threading.Lock()
        """Around what is counted or paced on the handlers' threads."""
        self._complaints = ComplaintPace()
        self._successors: dict[str, str] = {}

    def add_channel(
        self, channel: str, terms: DeliveryTerms, counters: ConnectorCounters, audience: Audience | None = None
    ) -> None:
        """A channel of a connector that sends."""
        timer = DeadlineTimer(partial(self._due, channel))
        self._channels[channel] = known = _Channel(terms, counters, timer, audience)
        if terms.max_rate_hz is not None and terms.limits.newest_wins:
            known.thinner = NewestThinning(terms.max_rate_hz)
        elif terms.max_rate_hz is not None:
            known.bucket = TokenBucket.of_rate(terms.max_rate_hz)

    def set_audience(self, channel: str, audience: Audience | None) -> None:
        """Another handler answers on the channel from now on. Event loop."""
        self._channels[channel].audience = audience

    def remove_channel(self, channel: str) -> None:
        """Nothing is sent there any more; what is under way is dropped. Event loop."""
        known = self._channels.pop(channel, None)
        if known is not None:
            known.timer.cancel()

    def post(self, message: Outgoing) -> bool:
        """Any thread. ``False``: nobody listens, or the message is too large, too soon, or every listener's queue is
        full; then it goes nowhere. What nobody hears is kept for the first who comes, if the channel latches."""
        channel = self._channels.get(message.channel)
        if channel is None or not self._fits(channel, message):
            return False
        hearing, full = self._hearing(channel, message), channel.full
        is_full = bool(hearing and full) and full.issuperset(hearing)
        if is_full and not self.taps.is_open(message.channel):
            return self._dropped(channel)
        if channel.bucket is not None and message.to is None and not self._admitted(channel, channel.bucket):
            return False
        too_much = len(self._handover) * message.size_bytes > _MAX_PENDING_BYTES
        if too_much or not self._handover.put(message):
            return self._dropped(channel)
        return bool(hearing) and not is_full

    def _hearing(self, channel: _Channel, message: Outgoing) -> tuple[str, ...]:
        """An answer to somebody whose session goes on with another peer is meant for that one."""
        to = message.to
        return channel.hearing(to if to is None else self._successors.get(to, to))

    def _fits(self, channel: _Channel, message: Outgoing) -> bool:
        size_bytes = len(message.payload)
        if message.followers:
            size_bytes = max(size_bytes, *map(len, message.followers))
        if size_bytes <= MAX_MESSAGE_BYTES:
            return True
        with self._lock:
            channel.counters.lose("too_large")
            is_due = self._complaints.is_due(message.channel, time.monotonic())
        if is_due:
            fields = {"label": message.channel, "code": "channel.too_large"}
            logger.error("%r: a message of %d bytes is too large to send", message.channel, size_bytes, extra=fields)
        return False

    def _dropped(self, channel: _Channel) -> bool:
        with self._lock:
            channel.counters.lose("dropped")
        return False

    def _admitted(self, channel: _Channel, bucket: TokenBucket) -> bool:
        with self._lock:
            admitted = bucket.admits(time.monotonic())
            channel.counters.thinned += not admitted
        return admitted

    def is_heard(self, channel: str) -> bool:
        """Any thread."""
        known = self._channels.get(channel)
        return known is not None and (bool(known.listeners) or self.taps.is_open(channel))

    # -- on the event loop ---------------------------------------------------------------------------------------

    def join(self, channel: str, peer_id: str, listener: Listener) -> Outgoing | None:
        """A peer opened the channel; the value it gets at once, if there is one."""
        known = self._channels.get(channel)
        if known is None:
            return None
        is_first = not self.is_heard(channel)
        known.listeners = {**known.listeners, peer_id: listener}
        if is_first:
            self._heard_changed(channel, True)
        return known.latched

    def leave(self, channel: str, peer_id: str) -> None:
        known = self._channels.get(channel)
        if known is None or peer_id not in known.listeners:
            return
        known.listeners = {key: value for key, value in known.listeners.items() if key != peer_id}
        known.full -= {peer_id}
        if known.audience is not None:
            known.audience.left(peer_id)
        if not self.is_heard(channel):
            self._heard_changed(channel, False)

    def tap(self, channel: str, reader: TapReader) -> Outgoing | None:
        """Somebody on the robot itself looks at the channel; what it gets at once, as in :meth:`join`."""
        is_first = not self.is_heard(channel)
        self.taps.add(channel, reader)
        if is_first:
            self._heard_changed(channel, True)
        return self._channels[channel].latched

    def untap(self, channel: str, reader: TapReader) -> None:
        self.taps.remove(channel, reader)
        if not self.is_heard(channel):
            self._heard_changed(channel, False)

    def hand_over(self, channel: str, peer_id: str, successor_id: str) -> None:
        """The session of a peer goes on with another one, and so does its channel."""
        known = self._channels.get(channel)
        if known is not None and peer_id in known.listeners:
            known.listeners = {successor_id if one == peer_id else one: who for one, who in known.listeners.items()}
            known.full -= {peer_id}
            if known.audience is not None:
                known.audience.handed_over(peer_id, successor_id)

    def succeed(self, peer_id: str, successor_id: str) -> None:
        """What still answers ``peer_id`` is meant for its successor."""
        kept = list(self._successors.items())[-_MAX_SUCCESSORS:]
        older = {old: successor_id if new == peer_id else new for old, new in kept}
        self._successors = {**older, peer_id: successor_id}

    def has_room(self, channel: str, peer_id: str) -> None:
        """The peer's queue has drained: its sender may go on."""
        known = self._channels.get(channel)
        if known is not None:
            known.full -= {peer_id}

    def left_out(self, channel: str, reason: Loss, messages: int) -> None:
        """Messages that a listener took, and left out after all."""
        known = self._channels.get(channel)
        if known is not None:
            with self._lock:
                known.counters.lose(reason, messages)

    def listeners(self, channel: str) -> int:
        known = self._channels.get(channel)
        return len(known.listeners) if known is not None else 0

    def waiting(self, channel: str) -> tuple[int, int]:
        """``(messages, bytes)`` in the longest queue of any peer."""
        known = self._channels.get(channel)
        queues = [listener.waiting(channel) for listener in known.listeners.values()] if known is not None else []
        return max(queues, default=(0, 0))

    def _arrived(self, message: Outgoing) -> None:
        channel = self._channels.get(message.channel)
        if channel is None:
            return
        if channel.thinner is None or message.to is not None:  # an answer to one is not a value among others
            self._distribute(channel, message)
            return
        before = channel.thinner.thinned
        now = channel.thinner.offer(message, self._loop.time())
        channel.counters.thinned += channel.thinner.thinned - before
        if now is not None:
            self._distribute(channel, now)
        elif not channel.timer.is_set:
            channel.timer.set(channel.thinner.due_at_s)

    def _due(self, label: str) -> None:
        channel = self._channels[label]
        assert channel.thinner is not None
        message = channel.thinner.due(self._loop.time())
        if message is not None:
            self._distribute(channel, message)
        else:  # another one went out meanwhile, or the clock is coarse
            channel.timer.set(channel.thinner.due_at_s)

    def _distribute(self, channel: _Channel, message: Outgoing) -> None:
        hearing, size_bytes = self._hearing(channel, message), message.size_bytes
        self.taps.sent(message)
        if not hearing and message.to is not None:  # an answer to somebody who takes none
            self.left_out(message.channel, "lost", 1)
        elif not hearing or self._offer(channel, hearing, message):  # unheard, its rate tells that the connector lives
            channel.counters.count(size_bytes, time.monotonic())
        if message.to is None and channel.terms.latch and size_bytes <= channel.terms.limits.size_bytes:
            channel.latched = message

    def _offer(self, channel: _Channel, hearing: tuple[str, ...], message: Outgoing) -> bool:
        """Offer it to all that it is for; ``False``: none of them took it."""
        is_taken = False
        for peer_id in hearing:
            offered = channel.listeners[peer_id].deliver(message)
            if offered is Offered.REFUSED:
                self._dropped(channel)
                channel.full |= {peer_id}
                continue
            is_taken = True
            if offered is Offered.REPLACED:
                self.left_out(message.channel, "replaced", 1)
        return is_taken
