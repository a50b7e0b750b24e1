"""Counts messages per connector, and declares the picture of the robot that the live table shows."""

from __future__ import annotations

import threading
from collections import Counter, deque
from collections.abc import Mapping
from dataclasses import dataclass, field

from mosaic_core.contract.host import Loss

_SLOTS, _SLOT_S = 10, 0.2
"""Rates are means over these, two seconds: steady enough to read, quick enough to see a loss."""


class RateMeter:
    """Messages and bytes per second. ``now_s``: any monotonic clock."""

    def __init__(self) -> None:
        self._slots: deque[tuple[int, int, int]] = deque(maxlen=_SLOTS)  # (slot number, messages, bytes)

    def add(self, size_bytes: int, now_s: float) -> None:
        number = int(now_s / _SLOT_S)
        if self._slots and self._slots[-1][0] == number:
            _, messages, total = self._slots[-1]
            self._slots[-1] = (number, messages + 1, total + size_bytes)
        else:
            self._slots.append((number, 1, size_bytes))

    def rates(self, now_s: float) -> tuple[float, float]:
        """``(messages per second, bytes per second)``."""
        oldest = int(now_s / _SLOT_S) - _SLOTS + 1
        recent = [slot for slot in tuple(self._slots) if slot[0] >= oldest]
        window_s = _SLOT_S * _SLOTS
        return sum(slot[1] for slot in recent) / window_s, sum(slot[2] for slot in recent) / window_s


@dataclass(slots=True)
class ConnectorCounters:
    """Counts what one connector sends, receives and loses. Written by one thread at a time, read anywhere. Sums over
    all operators, since the robot started.
    """

    messages: int = 0
    """Made, and not refused by all who listen; or carried out."""
    size_bytes: int = 0
    replaced: int = 0
    """Sent, but a newer one took its place before it left."""
    dropped: int = 0
    """Not taken, because a queue was full."""
    too_large: int = 0
    """Larger than any message may be, or than an original operator takes."""
    thinned: int = 0
    """Held back by a rate limit."""
    refused: int = 0
    """Messages of operators that were not accepted."""
    refused_by: Counter[str] = field(default_factory=Counter)
    """The same by the gate that refused."""
    lost: int = 0
    """Never delivered: the connection was gone for longer than the queue could keep them, or whoever an answer was for
    takes none."""
    resent: int = 0
    """Repeated after a connection was lost."""
    last_at_s: float | None = None
    meter: RateMeter = field(default_factory=RateMeter)

    def count(self, size_bytes: int, now_s: float) -> None:
        self.messages += 1
        self.size_bytes += size_bytes
        self.last_at_s = now_s
        self.meter.add(size_bytes, now_s)

    def refuse(self, gate: str) -> None:
        self.refused += 1
        self.refused_by[gate] += 1

    def lose(self, reason: Loss, messages: int = 1) -> None:
        setattr(self, reason, getattr(self, reason) + messages)


class HandlerLosses:
    """Counts the messages that one handler says it left out; any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._counts: dict[Loss, int] = {}

    def add(self, reason: Loss, messages: int) -> None:
        with self._lock:
            self._counts[reason] = self._counts.get(reason, 0) + messages

    def __getitem__(self, reason: Loss) -> int:
        return self._counts.get(reason, 0)


@dataclass(frozen=True, slots=True)
class ConnectorSnapshot:
    """The state and counts of one connector: a row of the live table. ``state``: ``waiting``, ``running``, ``failed``,
    ``ended`` or ``stopped``; the queue is the longest of any operator, or that of the receiver; the counts are those of
    :class:`ConnectorCounters`."""

    label: str
    type: str
    kind: str
    direction: str
    delivery: str
    state: str
    peers: int
    messages: int
    rate_hz: float
    size_bytes: int
    bytes_per_s: float
    queue_messages: int
    queue_bytes: int
    replaced: int
    dropped: int
    too_large: int
    thinned: int
    refused: int
    lost: int
    resent: int
    failures: int
    last_error: str
    age_s: float | None
    """Seconds since the last message; ``None``: there was none."""
    failure_code: str = ""
    """The ``plugin.*`` code of why it fails now."""
    tries_again_in_s: float | None = None
    """``None``: it does not fail."""
    limit_factor: float | None = None
    """What is left of the speed of whoever commands, 0 to 1; ``None``: nobody does, or nothing limits it here."""
    refused_by: Mapping[str, int] = field(default_factory=dict)
    """Operators' messages that were refused, by gate."""


@dataclass(frozen=True, slots=True)
class PeerSnapshot:
    """One operator's peer. ``phase`` is that of ``machines.peers.peer_of_robot``."""

    peer_id: str
    session_id: str
    operator_id: str
    name: str
    role: str
    phase: str
    connected_s: float | None
    channels: tuple[str, ...]
    watches: tuple[str, ...]
    is_person: bool = False
    is_original: bool = False


@dataclass(frozen=True, slots=True)
class LeaseSnapshot:
    """The lease of one resource: who commands it. ``holder_id``: its peer; ``None``: it is free. ``waiting``: names,
    the next first."""

    resource: str
    epoch: int
    holder_id: str | None
    holder: str
    is_person: bool
    waiting: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class StopSnapshot:
    """The robot was stopped and takes no commands. ``for_s``: for so long already."""

    by: str
    reason: str
    for_s: float


@dataclass(frozen=True, slots=True)
class ServerSnapshot:
    """The robot's connection to one server. ``name``: ``fleet`` for that of its configuration, ``lan`` for its own."""

    name: str
    url: str
    state: str


@dataclass(frozen=True, slots=True)
class LoopSnapshot:
    """The times that something held up the event loop since the robot started: how often each connector's code did
    (under the empty label whatever is no connector's), the longest time, and the last one's place."""

    blocks: Mapping[str, int]
    longest_s: float
    last_label: str
    last_place: str
    last_duration_s: float
    ago_s: float
    """Since the last one was over."""


@dataclass(frozen=True, slots=True)
class RobotSnapshot:
    """The robot now. ``state``: ``connecting``, ``ready``, ``offline`` or ``stopped``; of several servers the best."""

    robot_id: str
    state: str
    uptime_s: float
    connectors: tuple[ConnectorSnapshot, ...]
    peers: tuple[PeerSnapshot, ...]
    leases: tuple[LeaseSnapshot, ...] = ()
    stop: StopSnapshot | None = None
    """``None``: it is not stopped."""
    servers: tuple[ServerSnapshot, ...] = ()
    loop: LoopSnapshot | None = None
    """``None``: nothing has held it up."""
