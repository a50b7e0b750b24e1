"""Resumes one reliable channel of a session on the robot: keeps what its operator has not confirmed, whatever happens
to the connection, and tells what comes twice.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

from mosaic_core.contract.host import Outgoing
from mosaic_core.machines.delivery.framing import FrameFlag
from mosaic_core.machines.delivery.resume import ResumeLimits, ResumeReceiver, ResumeSender
from mosaic_core.machines.delivery.send_scheduler import Offered
from mosaic_core.runtime.observation.counters import ConnectorCounters
from mosaic_core.runtime.timing.deadline_timer import DeadlineTimer
from mosaic_core.words.control import Delivered

HEADER_BYTES = 64
"""What an empty message costs us: a queue of nothing else is bounded too."""
TELL_PERIOD_S = 0.25
"""What has arrived is told this late at the latest: the other side keeps it so long."""
TELL_AFTER = 128
"""Messages after which it is told at once, so that a fast sender need not forget what it keeps."""
Put = Callable[[Outgoing, FrameFlag, int], Offered]
"""Offers one numbered message to the connection's own queue."""


class ResumedStream:
    """Keeps and repeats what one session's channel is sent; an ``outbox.Listener``. Event loop only. ``has_room``:
    whether its session may keep more.
    """

    def __init__(
        self, label: str, counters: ConnectorCounters, limits: ResumeLimits, has_room: Callable[[int], bool]
    ) -> None:
        self.label = label
        self.was_opened = False
        """The operator has opened the channel in this session."""
        self._counters = counters
        self._has_room = has_room
        self._sender: ResumeSender[tuple[Outgoing, FrameFlag]] = ResumeSender(limits)
        self._put: Put | None = None
        self._waiting: Callable[[], tuple[int, int]] = lambda: (0, 0)

    @property
    def size_bytes(self) -> int:
        """What is kept."""
        return self._sender.size_bytes

    @property
    def upcoming(self) -> int:
        """The number that the next message on a new connection will have."""
        return self._sender.first_seq

    def resumed(self, received: int | None) -> None:
        """The operator is there and has everything up to ``received`` (``None``: it wants nothing of before); data
        flows once the channel is open."""
        self._sender.forget_old(time.monotonic())
        self._counters.lost += self._sender.resumed(received)

    def attach(self, put: Put, waiting: Callable[[], tuple[int, int]]) -> None:
        """The channel is open. ``waiting``: messages and bytes in the connection's own queue."""
        self.was_opened = True
        self._put, self._waiting = put, waiting
        self.pump()

    def closed(self) -> None:
        """The channel is closed, perhaps with its connection; messages wait."""
        self._put = None

    def detach(self) -> None:
        """The connection is lost; messages wait for the next one."""
        self._put = None
        self._sender.detached()

    def forget(self) -> None:
        """Whoever opens the channel next begins with what comes next: nothing of before is missed."""
        self._sender.abandoned()
        self.was_opened = False

    def abandon(self) -> None:
        """Nobody comes back for it: what was not confirmed is lost."""
        self._counters.lost += self._sender.abandoned()

    def delivered(self, seq: int) -> None:
        self._sender.delivered(seq)

    def deliver(self, message: Outgoing, flags: FrameFlag = FrameFlag.NONE) -> Offered:
        if message.followers:
            parts = [replace(message, payload=one, followers=()) for one in (message.payload, *message.followers)]
            return max(self.deliver(part) for part in parts)
        size_bytes = len(message.payload) + HEADER_BYTES
        if not self._has_room(size_bytes) or not self._sender.has_room(size_bytes, time.monotonic()):
            return Offered.REFUSED
        if self._put is not None and self._sender.waiting == 0:  # its place in line is that of the connection's queue
            offered = self._put(message, flags, self._sender.next_seq)
            if offered is not Offered.REFUSED:
                self._sender.accept((message, flags), size_bytes, time.monotonic())
                self._sender.went_out()
            return offered
        self._sender.accept((message, flags), size_bytes, time.monotonic())
        self.pump()
        return Offered.QUEUED

    def waiting(self, channel: str) -> tuple[int, int]:
        """Without a connection: what is kept for it. With one its own queue knows."""
        return (self._sender.unconfirmed, self._sender.size_bytes) if self._put is None else self._waiting()

    def pump(self) -> None:
        """Send what waits, as far as the connection's queue takes it; called again when that has room."""
        while self._put is not None and (numbered := self._sender.upcoming()) is not None:
            if self._put(*numbered.item, numbered.seq) is Offered.REFUSED:
                return
            self._counters.resent += numbered.is_repeated
            self._sender.went_out()


class DeliveredTeller:
    """Tells the other side what has arrived on the reliable channels of one session, so that it need not keep it: soon
    after a message, and at once after many. Event loop only."""

    def __init__(self, say: Callable[[Delivered], object]) -> None:
        self.receivers: dict[str, ResumeReceiver] = {}
        self._say = say
        self._untold = 0
        self._timer = DeadlineTimer(self._tell)

    def arrived(self) -> None:
        """One message more."""
        self._untold += 1
        if self._untold >= TELL_AFTER:
            self._tell()
        elif not self._timer.is_set:
            self._timer.set(time.monotonic() + TELL_PERIOD_S)

    def stop(self) -> None:
        """There is nobody to tell."""
        self._untold = 0
        self._timer.cancel()

    def _tell(self) -> None:
        self.stop()
        seqs = {label: seq for label, one in self.receivers.items() if (seq := one.untold()) is not None}
        if seqs:
            self._say(Delivered(seqs=seqs))
