"""Resumes the session of one peer, which outlives it: nothing of its reliable channels flows before both sides have
said how far they are, and a lost peer leaves what was not confirmed to the next one.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Literal

from mosaic_core.contract.handler import DataChannelReceivable
from mosaic_core.machines.delivery.framing import FrameFlag
from mosaic_core.machines.delivery.resume import Arrival, ResumeReceiver
from mosaic_core.machines.delivery.send_scheduler import Priority
from mosaic_core.runtime.control.command_desk import LOST
from mosaic_core.runtime.delivery.resumed_stream import DeliveredTeller
from mosaic_core.runtime.delivery.sessions import OperatorSession
from mosaic_core.runtime.timing.deadline_timer import DeadlineTimer
from mosaic_core.words.control import HELLO_TIMEOUT_S, Delivered, Hello, Resume
from mosaic_core.words.data_type import Direction

if TYPE_CHECKING:
    from mosaic_core.runtime.delivery.data_port import DataPort
    from mosaic_core.runtime.delivery.send_queue import SendQueue
    from mosaic_core.runtime.handlers.routes import Route
    from mosaic_core.runtime.peers.remote_operator import RemoteOperator
    from mosaic_core.runtime.peers.site import Site

RELEASE_AFTER_S = 1.0
"""A channel that closed alone was released on purpose; when its connection ends too, this is known by then."""


class PeerResume:
    """Joins one peer to the session of its operator; implements ``sessions.Owner``. Event loop only."""

    def __init__(self, operator: RemoteOperator, site: Site) -> None:
        self._operator = operator
        self._site = site
        self._phase: Literal["unknown", "expecting", "resumed", "plain"] = "unknown"
        self._boot_id = ""
        self._session: OperatorSession | None = None
        self._held: list[Callable[[], None]] = []
        self._teller = DeliveredTeller(operator.answer)
        self._patience = DeadlineTimer(self.plain)
        self._releases: dict[str, DeadlineTimer] = {}
        """Of channels that were closed, by label."""

    def when_known(self, route: Route, is_framed: bool, proceed: Callable[[], None]) -> None:
        """Call ``proceed`` as soon as data may flow on this channel."""
        if is_framed and _sends(route) and self._phase in ("unknown", "expecting"):
            self._held.append(proceed)
        else:
            proceed()

    def keeps(self, label: str) -> bool:
        """What goes out on this channel outlives the peer."""
        return self._session is not None and label in self._session.streams

    def opens(self, label: str) -> bool:
        """Whether the channel, which is open now, is to be attached to its session."""
        timer = self._releases.pop(label, None)
        if timer is not None and timer.is_set:
            timer.cancel()  # it was closed and opened again on this peer: whoever listens now is new
            self._release(label)
        return self.keeps(label)

    def attach(self, label: str, queue: SendQueue, port: DataPort) -> None:
        """Repeat what is missing, then go on; a newcomer begins with the latched value."""
        assert self._session is not None
        stream, outbox, peer_id = self._session.streams[label], self._site.outbox, self._session.peer_id
        is_newcomer = not stream.was_opened
        latched = outbox.join(label, peer_id, stream)
        stream.attach(
            lambda message, flags, seq: queue.offer(port.outgoing(message, flags, seq)), lambda: queue.waiting(label)
        )
        outbox.has_room(label, peer_id)
        if latched is not None and is_newcomer:
            stream.deliver(latched, FrameFlag.LATCHED)

    def has_room(self, label: str) -> None:
        """The connection's queue takes messages again."""
        self._site.outbox.has_room(label, self._operator.peer_id)
        if self._session is not None and label in self._session.streams:
            self._session.streams[label].pump()

    def arrived(self, route: Route, seq: int) -> bool:
        """A message has come; ``False``: it came before."""
        receiver = self._teller.receivers.get(route.label)
        if receiver is None:
            return True
        arrival: Arrival = receiver.arrived(seq)
        route.counters.lost += arrival.lost
        self._teller.arrived()
        return arrival.is_new

    def removed(self, label: str) -> None:
        """There is no such connector any more, or one that numbers anew: nothing of it is resumed."""
        timer = self._releases.pop(label, None)
        if timer is not None:
            timer.cancel()
        if self._session is not None:
            self._site.sessions.remove(self._session, label)

    def added(self, route: Route) -> None:
        """A connector has come: what the operator sends there is numbered, as it says so itself."""
        if self._session is not None and _takes(route):
            self._session.receivers.setdefault(route.label, ResumeReceiver(0))

    def channel_closed(self, label: str) -> None:
        """A channel closed while its peer goes on."""
        if self._session is not None and label in self._session.streams:
            self._session.streams[label].closed()
            self._releases[label] = timer = DeadlineTimer(lambda: self._release(label))
            timer.set(time.monotonic() + RELEASE_AFTER_S)

    # -- what the operator says ----------------------------------------------------------------------------------

    def said_hello(self, hello: Hello) -> None:
        if self._phase != "unknown":
            return
        self._boot_id = hello.boot_id
        if "resume" not in hello.extensions:
            self.plain()
            return
        self._phase = "expecting"
        self._patience.set(time.monotonic() + HELLO_TIMEOUT_S)

    def plain(self) -> None:
        """Its numbers begin anew with every connection: an original operator, or an older one."""
        if self._phase in ("unknown", "expecting"):
            self._phase = "plain"
            self._release_held()

    def resume_heard(self, message: Resume | Delivered) -> None:
        if isinstance(message, Delivered):
            streams = self._session.streams if self._session is not None else {}
            for label in message.seqs.keys() & streams.keys():
                streams[label].delivered(message.seqs[label])
            for label in streams:  # what was kept of one makes room for all
                self._site.outbox.has_room(label, self._operator.peer_id)
        elif self._phase == "expecting":
            self._resume(message)
        elif self._phase == "plain":  # it is too late: nothing takes part
            self._operator.answer(Resume(boot_id=self._site.boot_id, is_new=True))

    def _resume(self, theirs: Resume) -> None:
        self._phase = "resumed"
        sender, book = self._operator.sender, self._site.sessions
        session, is_known = book.claim(sender.session_id, sender.operator_id, self._boot_id, sender.peer_id, self)
        self._session, self._teller.receivers = session, session.receivers
        routes = self._site.routes
        taking = [label for label, route in routes.items() if _takes(route)]
        sending = {label: route.terms.limits for label, route in routes.items() if _sends(route)}
        received = theirs.received if theirs.boot_id == self._site.boot_id else {}
        book.resume(session, received, sending)
        for label in taking:
            self._announced(label, theirs.upcoming.get(label), is_known)
        self._operator.answer(
            Resume(
                boot_id=self._site.boot_id,
                is_new=not is_known,
                received={label: session.receivers[label].received or 0 for label in taking},
                upcoming={label: session.streams[label].upcoming for label in sending},
            )
        )
        self._release_held()

    def _announced(self, label: str, upcoming: int | None, is_known: bool) -> None:
        assert self._session is not None
        receivers = self._session.receivers
        receiver = receivers.setdefault(label, ResumeReceiver(0 if is_known or upcoming is None else None))
        if upcoming is not None:
            self._site.routes[label].counters.lost += receiver.announced(upcoming) or 0

    # -- its end -------------------------------------------------------------------------------------------------

    def dispossessed(self) -> None:
        """The session lives on another peer now."""
        self._session, self._teller.receivers = None, {}

    def peer_left(self, code: str) -> None:
        for timer in (self._patience, *self._releases.values()):
            timer.cancel()
        self._teller.stop()
        self._held.clear()
        session = self._session
        self.dispossessed()
        if session is not None:
            self._site.sessions.peer_left(session, self, is_lost=code in LOST)

    # -- inside --------------------------------------------------------------------------------------------------

    def _release_held(self) -> None:
        held, self._held = self._held, []
        for proceed in held:
            proceed()

    def _release(self, label: str) -> None:
        if self._session is not None:
            self._site.sessions.release(self._session, label)


def _sends(route: Route) -> bool:
    """What the robot sends there is numbered across connections. Bulk is not: a map is sent anew."""
    is_receiver_only = route.handler.direction is Direction.TO_ROBOT
    return not is_receiver_only and route.priority is Priority.RELIABLE and not route.terms.limits.newest_wins


def _takes(route: Route) -> bool:
    """What operators send there is numbered across connections: never what moves something, which is never repeated."""
    is_free = not route.safety.is_motion and route.safety.max_rate_hz is None
    return isinstance(route.handler, DataChannelReceivable) and route.priority is Priority.RELIABLE and is_free
