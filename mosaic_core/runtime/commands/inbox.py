"""Queues the commands that wait for a receiver: one slot per sender under ``latest``, otherwise a queue as bounded as a
sender's. Thread-safe.

A message whose sender has left is forgotten; one that waited too long behind a slow ``handle_data`` is handed out as
stale, so that an old command never moves anything.
"""

from __future__ import annotations

import threading
from collections import OrderedDict, deque
from dataclasses import dataclass

from mosaic_core.contract.host import Sender
from mosaic_core.machines.delivery.send_scheduler import LIMITS, Priority, QueueLimits


@dataclass(frozen=True, slots=True)
class Incoming:
    """A message for a receiver. ``seq`` and ``epoch`` are ``None`` on the bare channels of original operators;
    ``opening`` and ``generation`` are its watch's when it arrived."""

    channel: str
    payload: bytes
    sender: Sender
    seq: int | None
    arrived_at_s: float
    epoch: int | None = None
    opening: int = 0
    generation: int = 0
    has_paused: bool = False
    """Its sender had sent nothing for as long as the receiver's time-out."""
    request_id: str | None = None
    """Of a question: the operator's own number for it, if it has one."""
    request: int = 0
    """Of a question that waits for its answer: the robot's number for it."""


class Inbox:
    """Queues the commands that wait for one receiver. Filled on the event loop, emptied by the receiver."""

    def __init__(self, *, newest_only: bool, limits: QueueLimits = LIMITS[Priority.RELIABLE]) -> None:
        self._newest_only = newest_only
        self._limits = limits
        self._filled = threading.Condition()
        self._slots: OrderedDict[str, Incoming] = OrderedDict()
        self._queue: deque[Incoming] = deque()
        self._size_bytes = 0
        self._is_closed = False
        self._is_held = False
        self._is_poked = False
        self.replaced = 0

    def put(self, item: Incoming) -> bool:
        """``False`` if the queue is full."""
        with self._filled:
            if self._newest_only:
                self.replaced += item.sender.peer_id in self._slots
                self._slots[item.sender.peer_id] = item
            else:
                while self._queue and self._is_full(len(item.payload)):
                    if not self._limits.newest_wins:
                        return False
                    self._size_bytes -= len(self._queue.popleft().payload)
                    self.replaced += 1
                self._queue.append(item)
                self._size_bytes += len(item.payload)
            self._filled.notify_all()
            return True

    def _is_full(self, more_bytes: int) -> bool:
        limits = self._limits
        return len(self._queue) >= limits.messages or self._size_bytes + more_bytes > limits.size_bytes

    def take(self) -> Incoming | None:
        """The next one if there is one."""
        with self._filled:
            return self._pop()

    def wait(self, timeout_s: float | None = None) -> Incoming | None:
        """Block this thread until there is one; ``None``: closed, :meth:`poked <poke>`, or none within the time."""
        with self._filled:
            self._filled.wait_for(lambda: self._is_closed or self._is_poked or self._has_one(), timeout_s)
            self._is_poked = False
            return None if self._is_closed else self._pop()

    def poke(self) -> None:
        """Wake whoever waits, without a message."""
        with self._filled:
            self._is_poked = True
            self._filled.notify_all()

    @property
    def is_closed(self) -> bool:
        return self._is_closed

    def hold(self) -> None:
        """Hand out nothing until :meth:`resume`; what comes meanwhile waits."""
        with self._filled:
            self._is_held = True

    def resume(self) -> None:
        with self._filled:
            self._is_held = False
            self._filled.notify_all()

    def _has_one(self) -> bool:
        return not self._is_held and bool(self._slots or self._queue)

    def _pop(self) -> Incoming | None:
        if self._is_held:
            return None
        if self._slots:
            return self._slots.popitem(last=False)[1]
        if not self._queue:
            return None
        item = self._queue.popleft()
        self._size_bytes -= len(item.payload)
        return item

    def forget(self, peer_id: str | None) -> None:
        """Drop what this peer still wanted; ``None``: what anybody wanted."""
        with self._filled:
            if peer_id is None:
                self._slots.clear()
                self._queue.clear()
                self._size_bytes = 0
                return
            self._slots.pop(peer_id, None)
            kept = [item for item in self._queue if item.sender.peer_id != peer_id]
            self._queue = deque(kept)
            self._size_bytes = sum(len(item.payload) for item in kept)

    def close(self) -> None:
        with self._filled:
            self._is_closed = True
            self._filled.notify_all()

    def waiting(self) -> tuple[int, int]:
        """``(messages, bytes)``."""
        with self._filled:
            slots = sum(len(item.payload) for item in self._slots.values())
            return len(self._slots) + len(self._queue), slots + self._size_bytes
