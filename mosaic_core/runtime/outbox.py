"""From the handlers to the peers: who listens to which channel, what late joiners get, and the way to the event loop.

``post`` runs on the handler's thread and never blocks: it looks at two snapshots that the loop replaces as a whole.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable
from typing import Protocol

from mosaic_core.contract.host import Outgoing
from mosaic_core.machines.delivery_terms import DeliveryTerms
from mosaic_core.machines.framing import MAX_MESSAGE_BYTES
from mosaic_core.machines.send_scheduler import Offered
from mosaic_core.runtime.counters import ConnectorCounters
from mosaic_core.runtime.handover import Handover

logger = logging.getLogger(__name__)


_MAX_PENDING_BYTES = 64 * 1024 * 1024
"""What handlers may have waiting for an event loop that stands still."""


class Listener(Protocol):
    """A peer that has channels open."""

    def deliver(self, message: Outgoing) -> Offered: ...


class Outbox:
    """Of one robot. ``listened``: told on the loop when a channel gets its first or loses its last listener."""

    def __init__(self, loop: asyncio.AbstractEventLoop, listened: Callable[[str, bool], None]) -> None:
        self._handover: Handover[Outgoing] = Handover(loop, self._distribute)
        self._listened = listened
        self._listeners: dict[str, dict[str, Listener]] = {}
        self._full: frozenset[tuple[str, str]] = frozenset()
        self._counters: dict[str, ConnectorCounters] = {}
        self._latching: set[str] = set()
        self._latched: dict[str, Outgoing] = {}
        self._complained: set[str] = set()

    def add_channel(self, channel: str, terms: DeliveryTerms, counters: ConnectorCounters) -> None:
        """A channel of a connector that sends."""
        self._counters[channel] = counters
        self._listeners[channel] = {}
        if terms.latch:
            self._latching.add(channel)

    def post(self, message: Outgoing) -> bool:
        """Any thread. ``False``: nobody listens, the message is too large, or every listener's queue is full."""
        largest = max(len(message.payload), *map(len, message.followers)) if message.followers else len(message.payload)
        if largest > MAX_MESSAGE_BYTES:
            self._complain(message.channel, largest)
            return False
        too_much = len(self._handover) * message.size_bytes > _MAX_PENDING_BYTES
        if too_much or not self._handover.put(message):
            counters = self._counters.get(message.channel)
            if counters is not None:
                counters.dropped += 1
            return False
        listeners = self._listeners.get(message.channel, {})
        full = self._full
        return any(
            (peer_id, message.channel) not in full
            for peer_id in tuple(listeners)
            if message.to is None or message.to == peer_id
        )

    def _complain(self, channel: str, size_bytes: int) -> None:
        if channel not in self._complained:
            self._complained.add(channel)
            fields = {"label": channel, "code": "channel.too_large"}
            logger.error("%r: a message of %d bytes is too large to send", channel, size_bytes, extra=fields)

    def is_heard(self, channel: str) -> bool:
        """Any thread."""
        return bool(self._listeners.get(channel))

    # -- on the event loop ---------------------------------------------------------------------------------------

    def join(self, channel: str, peer_id: str, listener: Listener) -> Outgoing | None:
        """A peer opened the channel; the value it gets at once, if there is one."""
        listeners = self._listeners.get(channel)
        if listeners is None:
            return None
        self._listeners[channel] = {**listeners, peer_id: listener}
        if not listeners:
            self._listened(channel, True)
        return self._latched.get(channel)

    def leave(self, channel: str, peer_id: str) -> None:
        listeners = self._listeners.get(channel)
        if listeners is None or peer_id not in listeners:
            return
        self._listeners[channel] = {key: value for key, value in listeners.items() if key != peer_id}
        self._full -= {(peer_id, channel)}
        if not self._listeners[channel]:
            self._listened(channel, False)

    def has_room(self, channel: str, peer_id: str) -> None:
        """The peer's queue has drained: its sender may go on."""
        self._full -= {(peer_id, channel)}

    def listeners(self, channel: str) -> int:
        return len(self._listeners.get(channel, ()))

    def _distribute(self, message: Outgoing) -> None:
        counters = self._counters.get(message.channel)
        if counters is None:
            return
        if message.to is None and message.channel in self._latching:
            self._latched[message.channel] = message
        for peer_id, listener in tuple(self._listeners[message.channel].items()):
            if message.to is not None and message.to != peer_id:
                continue
            offered = listener.deliver(message)
            counters.dropped += offered is not Offered.QUEUED
            if offered is Offered.REFUSED:
                self._full |= {(peer_id, message.channel)}
        counters.count(message.size_bytes, time.monotonic())
