"""What is counted per connector, and the picture of the robot that the live table shows."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

_WINDOW_S = 2.0
"""Rates are means over this long: steady enough to read, quick enough to see a loss."""


class RateMeter:
    """Messages and bytes per second, in ten slots of the window. ``now_s``: any monotonic clock."""

    def __init__(self, window_s: float = _WINDOW_S) -> None:
        self._slot_s = window_s / 10
        self._slots: deque[tuple[int, int, int]] = deque(maxlen=10)  # (slot number, messages, bytes)

    def add(self, size_bytes: int, now_s: float) -> None:
        number = int(now_s / self._slot_s)
        if self._slots and self._slots[-1][0] == number:
            _, messages, total = self._slots[-1]
            self._slots[-1] = (number, messages + 1, total + size_bytes)
        else:
            self._slots.append((number, 1, size_bytes))

    def rates(self, now_s: float) -> tuple[float, float]:
        """``(messages per second, bytes per second)``."""
        oldest = int(now_s / self._slot_s) - 9
        recent = [slot for slot in tuple(self._slots) if slot[0] >= oldest]
        window_s = self._slot_s * 10
        return sum(slot[1] for slot in recent) / window_s, sum(slot[2] for slot in recent) / window_s


@dataclass(slots=True)
class ConnectorCounters:
    """Written on the event loop, read anywhere. ``dropped``: replaced by a newer value or the queue was full;
    ``refused``: messages of operators that were not accepted."""

    messages: int = 0
    size_bytes: int = 0
    dropped: int = 0
    refused: int = 0
    last_at_s: float | None = None
    meter: RateMeter = field(default_factory=RateMeter)

    def count(self, size_bytes: int, now_s: float) -> None:
        """One message sent or received."""
        self.messages += 1
        self.size_bytes += size_bytes
        self.last_at_s = now_s
        self.meter.add(size_bytes, now_s)


@dataclass(frozen=True, slots=True)
class ConnectorSnapshot:
    """One row of the live table. ``state``: ``waiting``, ``running``, ``failed``, ``ended`` or ``stopped``."""

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
    dropped: int
    refused: int
    failures: int
    last_error: str
    age_s: float | None
    """Seconds since the last message; ``None``: there was none."""
    limit_factor: float | None = None
    """What is left of the speed of whoever commands, 0 to 1; ``None``: nobody does, or nothing limits it here."""


@dataclass(frozen=True, slots=True)
class PeerSnapshot:
    """One operator's peer. ``phase`` is that of ``machines.peer_session``."""

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
    """Who commands one resource. ``holder_id``: its peer; ``None``: it is free. ``waiting``: names, the next first."""

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
class RobotSnapshot:
    """The robot now. ``state``: ``connecting``, ``ready``, ``offline`` or ``stopped``."""

    robot_id: str
    state: str
    uptime_s: float
    connectors: tuple[ConnectorSnapshot, ...]
    peers: tuple[PeerSnapshot, ...]
    leases: tuple[LeaseSnapshot, ...] = ()
    stop: StopSnapshot | None = None
    """``None``: it is not stopped."""
