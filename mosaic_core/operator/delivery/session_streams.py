"""The operator's reliable channels, which outlive its connections: numbered on, repeated where the robot lacks
something, and never used before both sides have said how far they are.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping
from typing import Literal

from mosaic_core.machines.delivery.framing import Frame
from mosaic_core.machines.delivery.resume import ResumeReceiver
from mosaic_core.operator.delivery.outgoing_stream import OutgoingStream
from mosaic_core.runtime.delivery.resumed_stream import DeliveredTeller
from mosaic_core.runtime.timing.deadline_timer import DeadlineTimer
from mosaic_core.words.control import HELLO_TIMEOUT_S, ControlMessage, Delivered, Resume

MAX_HELD = 4096
"""Messages that overtook the robot's word; far more than a round trip of anything."""


class SessionStreams:
    """Numbers what travels on reliable channels across the peers of one connection. Event loop only.

    ``tell``: says something on the control channel; ``missed(label, lost, is_sent)``: so many messages will
    never come, or never arrived; ``None``: nobody knows how many.
    """

    def __init__(
        self,
        tell: Callable[[ControlMessage], object],
        missed: Callable[[str, int | None, bool], None],
        clock_us: Callable[[], int],
    ) -> None:
        self._teller = DeliveredTeller(tell)
        self._clock_us = clock_us
        self._missed = missed
        self._phase: Literal["unknown", "expecting", "resumed", "plain", "away", "closed"] = "unknown"
        self._robot_boot_id = ""
        self._outgoing: dict[str, OutgoingStream] = {}
        self._receivers = self._teller.receivers
        self._numbered: Collection[str] = ()
        self._held: list[tuple[str, Frame, Callable[[Frame], None]]] = []
        self._patience = DeadlineTimer(self.plain)

    # -- the life of a connection ------------------------------------------------------------------------------------

    def resume_word(self) -> Resume:
        """What to say right after hello."""
        return Resume(
            boot_id=self._robot_boot_id,
            received={label: one.received for label, one in self._receivers.items() if one.received is not None},
            upcoming={label: stream.upcoming for label, stream in self._outgoing.items() if stream.is_numbered},
        )

    def greeted(self, extensions: Mapping[str, int]) -> None:
        if self._phase in ("unknown", "away"):
            self._phase = "expecting"
            if "resume" not in extensions:
                self.plain()
            else:
                self._patience.set(time.monotonic() + HELLO_TIMEOUT_S)

    def plain(self) -> None:
        """The robot's numbers begin anew with every connection: an original one, or an older one of ours."""
        if self._phase in ("unknown", "away", "expecting"):
            self._settled("plain", Resume(is_new=True))

    def progress_heard(self, message: Resume | Delivered) -> None:
        """How far the robot has got: all that it says of reliable channels."""
        if isinstance(message, Resume):
            if self._phase == "expecting":
                self._robot_boot_id = message.boot_id
                self._settled("resumed", message)
            return
        for label in message.seqs.keys() & self._outgoing.keys():
            self._outgoing[label].delivered(message.seqs[label])

    def leaving(self) -> None:
        """A good-bye comes next."""
        for stream in self._outgoing.values():
            stream.leaving()

    def lost(self) -> None:
        """The connection is gone and will be made anew."""
        if self._phase != "closed":
            self._patience.cancel()
            self._teller.stop()
            self._phase = "away"
            self._held.clear()
            for stream in self._outgoing.values():
                stream.lost()

    def close(self) -> None:
        self._patience.cancel()
        self._teller.stop()
        self._phase = "closed"
        self._held.clear()
        for label, stream in self._outgoing.items():
            self._report(label, stream.close(), sent=True)

    def _settled(self, phase: Literal["resumed", "plain"], word: Resume) -> None:
        self._phase = phase
        self._patience.cancel()
        self._numbered = word.upcoming.keys()
        for label, upcoming in word.upcoming.items():
            self._announced(label, upcoming, word.is_new)
        for label, stream in self._outgoing.items():
            self._report(label, self._resumed(label, stream, word), sent=True)
        held, self._held = self._held, []
        for label, frame, deliver in held:
            self.arrived(label, frame, deliver)

    def _announced(self, label: str, upcoming: int, is_new: bool) -> None:
        receiver = self._receivers.get(label)
        if receiver is None or is_new:
            if receiver is not None:
                self._report(label, receiver.announced(None), sent=False)
            receiver = self._receivers[label] = ResumeReceiver(None)
        self._report(label, receiver.announced(upcoming), sent=False)

    def _resumed(self, label: str, stream: OutgoingStream, word: Resume) -> int:
        if label not in word.received:
            return stream.plain()
        return stream.resumed(None if word.is_new else word.received[label])

    # -- what arrives ------------------------------------------------------------------------------------------------

    def arrived(self, label: str, frame: Frame, deliver: Callable[[Frame], None]) -> None:
        """A message of a reliable channel: handed on once, in order, as soon as it is known whether it is new."""
        if self._phase in ("unknown", "expecting", "away"):
            if len(self._held) < MAX_HELD:
                self._held.append((label, frame, deliver))
            return
        receiver = self._receivers.get(label)
        if self._phase == "plain" or receiver is None or label not in self._numbered:
            deliver(frame)
            return
        arrival = receiver.arrived(frame.seq)
        self._teller.arrived()
        self._report(label, arrival.lost, sent=False)
        if arrival.is_new:
            deliver(frame)

    def released(self, label: str) -> None:
        """The store of this channel is gone; the next one misses nothing of before."""
        if label in self._receivers:
            self._receivers[label].renewed()
        if label in self._outgoing:
            self._outgoing[label].released()

    # -- what is sent ------------------------------------------------------------------------------------------------

    def outgoing(self, label: str, *, waits: bool) -> OutgoingStream:
        """``waits``: what is sent while there is no connection is kept for the next one."""
        stream = self._outgoing.get(label)
        if stream is None:
            stream = self._outgoing[label] = OutgoingStream(self._clock_us, waits=waits)
            if self._phase == "plain":
                stream.plain()
            elif self._phase == "resumed":
                stream.resumed(0)
        return stream

    # -- inside ------------------------------------------------------------------------------------------------------

    def _report(self, label: str, lost: int | None, *, sent: bool) -> None:
        if lost != 0:
            self._missed(label, lost, sent)
