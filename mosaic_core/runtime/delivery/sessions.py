"""Remembers the sessions of operators while they have no connection: 60 seconds after a loss, of a bounded number of
sessions; a good-bye ends it at once.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

from mosaic_core.machines.delivery.resume import ResumeLimits, ResumeReceiver
from mosaic_core.machines.delivery.send_scheduler import QueueLimits
from mosaic_core.runtime.delivery.outbox import Outbox
from mosaic_core.runtime.delivery.resumed_stream import ResumedStream
from mosaic_core.runtime.observation.counters import ConnectorCounters
from mosaic_core.runtime.timing.deadline_timer import DeadlineTimer

AWAY_S = 60.0
"""Who was lost and is not back after this long begins anew: a page that was reloaded or put to sleep."""
MAX_AWAY = 8
"""Sessions without a connection; the one that has been away longest is forgotten for one more."""
AWAY_BYTES, LIVE_BYTES = 8 * 1024 * 1024, 32 * 1024 * 1024
"""What may be accepted for one session, all its channels together: without a connection, and with one. It is kept then
in any case."""


class Owner(Protocol):
    """The peer on which a session lives."""

    def dispossessed(self) -> None:
        """The session lives on another peer now."""


@dataclass(slots=True)
class OperatorSession:
    """One operator's page or program. ``peer_id``: its newest peer, under which its channels are in the outbox."""

    session_id: str
    operator_id: str
    boot_id: str
    peer_id: str
    owner: Owner | None
    streams: dict[str, ResumedStream] = field(default_factory=dict)
    """What the robot sends, by label."""
    receivers: dict[str, ResumeReceiver] = field(default_factory=dict)
    """What it receives."""
    left_at_s: float = 0.0
    """When its last connection was lost."""
    timer: DeadlineTimer | None = None
    """Forgets it while it has none."""

    def has_room(self, size_bytes: int) -> bool:
        most_bytes = AWAY_BYTES if self.owner is None else LIVE_BYTES
        return sum(stream.size_bytes for stream in self.streams.values()) + size_bytes <= most_bytes


class SessionBook:
    """Keeps the sessions of one robot's operators from one peer to the next. Event loop only. ``counters``: of the
    connector behind a channel's label."""

    def __init__(self, outbox: Outbox, counters: Callable[[str], ConnectorCounters], away_s: float = AWAY_S) -> None:
        self._outbox = outbox
        self._counters = counters
        self._away_s = away_s
        self._sessions: dict[tuple[str, str], OperatorSession] = {}

    def __len__(self) -> int:
        return len(self._sessions)

    def claim(
        self, session_id: str, operator_id: str, boot_id: str, peer_id: str, owner: Owner
    ) -> tuple[OperatorSession, bool]:
        """The session of a peer that has said hello, and whether it is remembered. Another ``boot_id`` is another run
        of the operator's page or program: it remembers nothing itself."""
        key = (session_id, operator_id)
        known = self._sessions.get(key)
        if known is not None and known.boot_id == boot_id:
            self._hand_over(known, peer_id, owner)
            return known, True
        if known is not None:
            self._end(known)
        session = self._sessions[key] = OperatorSession(session_id, operator_id, boot_id, peer_id, owner)
        return session, False

    def resume(self, session: OperatorSession, received: Mapping[str, int], queues: Mapping[str, QueueLimits]) -> None:
        """The operator has what ``received`` says; of a channel that it doesn't name it wants nothing of before.
        ``queues``: every channel that the robot numbers, and what may wait for it."""
        for label, queue in queues.items():
            stream = session.streams.get(label)
            if stream is None:
                limits = ResumeLimits(queue.messages, queue.size_bytes, age_s=self._away_s)
                stream = ResumedStream(label, self._counters(label), limits, session.has_room)
                session.streams[label] = stream
            if label not in received:
                self.release(session, label)
            stream.resumed(received.get(label))

    def remove(self, session: OperatorSession, label: str) -> None:
        """The channel is no more: nothing is kept for it."""
        self._outbox.leave(label, session.peer_id)
        session.streams.pop(label, None)
        session.receivers.pop(label, None)

    def release(self, session: OperatorSession, label: str) -> None:
        """Nobody listens to the channel any more, on purpose."""
        self._outbox.leave(label, session.peer_id)
        session.streams[label].forget()

    def peer_left(self, session: OperatorSession, owner: Owner, *, is_lost: bool) -> None:
        """Its peer has ended. ``is_lost``: it may come back."""
        if session.owner is not owner:
            return
        session.owner = None
        if not is_lost:
            for stream in session.streams.values():
                stream.forget()  # on purpose, so nothing is missed of what was not confirmed yet
            self._end(session)
            return
        for stream in session.streams.values():
            stream.detach()
        session.left_at_s = time.monotonic()
        session.timer = DeadlineTimer(lambda: self._end(session))
        session.timer.set(session.left_at_s + self._away_s)
        away = [one for one in self._sessions.values() if one.owner is None]
        if len(away) > MAX_AWAY:
            self._end(min(away, key=lambda one: one.left_at_s))

    def close(self) -> None:
        for session in list(self._sessions.values()):
            self._end(session)

    def _hand_over(self, session: OperatorSession, peer_id: str, owner: Owner) -> None:
        previous, session.owner = session.owner, owner
        if session.timer is not None:
            session.timer.cancel()
            session.timer = None
        for stream in session.streams.values():
            stream.detach()
        for label in session.streams:
            self._outbox.hand_over(label, session.peer_id, peer_id)
        self._outbox.succeed(session.peer_id, peer_id)
        session.peer_id = peer_id
        if previous is not None and previous is not owner:
            previous.dispossessed()

    def _end(self, session: OperatorSession) -> None:
        if session.timer is not None:
            session.timer.cancel()
        session.owner = None
        for label, stream in session.streams.items():
            self._outbox.leave(label, session.peer_id)
            stream.detach()
            stream.abandon()
        session.streams.clear()
        if self._sessions.get((session.session_id, session.operator_id)) is session:
            del self._sessions[session.session_id, session.operator_id]
