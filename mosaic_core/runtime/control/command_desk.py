"""Drives the leases and the stop, and tells everybody who commands; the deciding is the machines', the fencing
:class:`~mosaic_core.runtime.commands.fence.Fence`'s.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Iterator
from typing import Protocol

from mosaic_core.contract.host import Sender
from mosaic_core.machines.commands.gates import Gate, GateRefusal
from mosaic_core.machines.control import lease_events as lease
from mosaic_core.machines.control.stop_rights import RightToStop, StopRights
from mosaic_core.machines.timing.pacing import TokenBucket
from mosaic_core.runtime.commands.fence import SAFE, Fence
from mosaic_core.runtime.control import control_words as words
from mosaic_core.runtime.control.journal import RobotJournal, name_of
from mosaic_core.runtime.threads.handover import Handover
from mosaic_core.words import control
from mosaic_core.words.control import CONTROL_LABEL, STOP_LABEL, ControlMessage

logger = logging.getLogger(__name__)

REQUESTS_PER_S = 50.0
"""Of one peer; a program that takes a dozen resources at once is still within it."""
KEEPS_PER_S = 20.0
"""Ten times what a holder sends; the surplus says nothing new."""
STOPS_PER_S = 200.0
"""Copies of a stop that are acknowledged; every copy stops."""
LOST = frozenset({"peer.lost", "peer.replaced", "peer.reloaded", "ice.failed", "ice.timeout", "dtls.timeout"})
"""Ends after which the same session may come back and keep its lease until it expires."""
MAX_AWAITED = 64
TellReply = Callable[[ControlMessage], object]


def _account_of(sender: Sender) -> str:
    return sender.operator_id or sender.session_id or sender.peer_id


class Controlled(Protocol):
    """A peer, as the desk sees it."""

    @property
    def sender(self) -> Sender: ...
    def ping(self) -> None: ...
    def tell(self, message: ControlMessage) -> None:
        """Say it on the control channel, if the operator knows such messages."""

    def answer(self, message: ControlMessage) -> None:
        """Say it there to whoever has just asked."""


class DeskListener(Protocol):
    """Hears what the command desk decides; on the event loop."""

    def lease_changed(self, resource: str, holder: Sender | None, epoch: int, cause: str) -> None: ...
    def stop_changed(self, is_stopped: bool, by: str, reason: str) -> None: ...


class _Present:
    """A peer that is there, and how much it has asked."""

    def __init__(self, peer: Controlled) -> None:
        self.peer = peer
        self.requests = TokenBucket.of_rate(REQUESTS_PER_S)
        self.keeps = TokenBucket.of_rate(KEEPS_PER_S)
        self.stops = TokenBucket.of_rate(STOPS_PER_S)
        self.refused_stop = ""
        """The last stop that was refused, of which it has been told."""


class CommandDesk:
    """Hears leases, stops and clearings of all operators. Event loop only, but for :meth:`pass_on`."""

    def __init__(self, journal: RobotJournal, listener: DeskListener) -> None:
        self._loop = asyncio.get_running_loop()
        self._handover: Handover[lease.Effect | str] = Handover(self._loop, self._carry_out)
        self._journal = journal
        self._listener = listener
        self._present: dict[str, _Present] = {}
        self._awaited: dict[tuple[str, str], TellReply] = {}
        self._rights = StopRights()
        self._fence: Fence | None = None
        self._stop_account = ""
        """Of whoever stopped or cleared the robot last."""

    def pass_on(self, effect: lease.Effect | str) -> None:
        """An effect of the fence, on any thread and under its lock."""
        self._handover.put(effect)

    def attach(self, fence: Fence) -> None:
        self._fence = fence

    @property
    def fence(self) -> Fence:
        assert self._fence is not None
        return self._fence

    # -- peers ---------------------------------------------------------------------------------------------------

    def peer_joined(self, peer: Controlled) -> None:
        """A peer is there, or has said who it is: it hears how things stand, and the others of it."""
        self._present.setdefault(peer.sender.peer_id, _Present(peer))
        self.fence.handle(lease.PartyJoined(words.party_of(peer.sender)))
        self._tell_peers()
        with self.fence.lock:
            states: list[ControlMessage] = [
                words.lease_state(self.fence.desk, resource) for resource in self.fence.desk.resources
            ]
            states.append(words.stop_state(self.fence.latch, account=self._stop_account))
        for state in states:
            peer.tell(state)

    def peer_left(self, peer: Controlled, code: str) -> None:
        if self._present.pop(peer.sender.peer_id, None) is None:
            return
        self.fence.handle(lease.PartyLeft(peer.sender.peer_id, on_purpose=code not in LOST))
        self._tell_peers()

    def knows(self, peer_id: str) -> bool:
        """Whether this peer has said who it is, or was taken for an original one."""
        return peer_id in self._present

    def _tell_peers(self) -> None:
        senders = [one.peer.sender for one in self._present.values()]
        infos = tuple(words.peer_info(words.party_of(sender), self._stop_right(sender)) for sender in senders)
        for peer in self._peers():
            peer.tell(control.Peers(you=peer.sender.peer_id, peers=infos))

    def _peers(self) -> Iterator[Controlled]:
        return iter([one.peer for one in self._present.values()])

    def ping_all(self) -> None:
        for peer in self._peers():
            peer.ping()

    def limited(self, peer_id: str, limit: control.SafetyLimit) -> None:
        """Tell whoever commands what is left of its speed."""
        present = self._present.get(peer_id)
        if present is not None:
            present.peer.tell(limit)

    def time_passed(self, now_s: float) -> None:
        self._journal.flush(now_s)

    def holder_id(self, resource: str) -> str | None:
        """The peer that commands ``resource``."""
        with self.fence.lock:
            holder = self.fence.desk.holder(resource)
        return holder.peer_id if holder is not None else None

    # -- what peers say ------------------------------------------------------------------------------------------

    def control_heard(self, peer: Controlled, message: ControlMessage, now_s: float) -> None:
        """A message about control. Whoever asks too much is told so, and nothing happens."""
        peer_id = peer.sender.peer_id
        present = self._present.get(peer_id)
        if isinstance(message, control.LeaseKeep):
            if present is not None and present.keeps.admits(now_s):
                self.fence.handle(lease.Kept(peer_id, message.epochs))
            return
        if present is None or not present.requests.admits(now_s):
            peer.answer(control.Refusal(label=CONTROL_LABEL, code="signal.too_slow" if present else "lease.required"))
            return
        match message:
            case control.LeaseRequest(resource=resource, reason=reason, force=force):
                self.fence.handle(lease.Requested(peer_id, resource, reason, force))
            case control.LeaseRelease(resource=resource):
                self.fence.handle(lease.Released(peer_id, resource))
            case control.LeaseAnswer():
                self.fence.handle(
                    lease.RequestAnswered(peer_id, message.resource, message.peer_id, message.grant, message.message)
                )
            case control.StopClear():
                self._clear(peer, now_s)
            case control.StopRight(peer_id=of, may_stop=may_stop):
                self._change_right(peer, of, may_stop)
            case control.JournalRead(limit=limit, before=before):
                self._read_journal(peer, limit, before)

    def stop_heard(self, peer: Controlled, message: control.Stop, answer: TellReply, now_s: float) -> None:
        """Stop first, then speak. ``answer`` says it where the stop was heard."""
        name = name_of(peer.sender)
        if not self._stop_right(peer.sender).may_stop:
            self._refuse_stop(peer, message.id)
            return
        is_new, times = self.fence.stop(name, message.reason, message.id)
        present = self._present.get(peer.sender.peer_id)
        if present is None or present.stops.admits(now_s):
            answer(words.stop_ack(message.id, times))
        key = (peer.sender.peer_id, message.id)
        if times.safe_s is None and (key in self._awaited or len(self._awaited) < MAX_AWAITED):
            self._awaited[key] = answer
        if is_new:
            self._stop_changed(True, peer.sender, message.reason)

    def _stop_right(self, sender: Sender) -> RightToStop:
        return self._rights.right(words.party_of(sender), _account_of(sender))

    def _refuse_stop(self, peer: Controlled, stop_id: str) -> None:
        """Told once for all copies of a stop."""
        present = self._present.get(peer.sender.peer_id)
        if present is None or present.refused_stop == stop_id:
            return
        present.refused_stop = stop_id
        self._refuse(peer, "safety.stop_taken")

    def _refuse(self, peer: Controlled, code: str) -> None:
        """Tell a peer what its role forbids of the stop, and write it down."""
        peer.answer(control.Refusal(label=STOP_LABEL, code=code, gate=Gate.ROLE))
        self._journal.refused(STOP_LABEL, peer.sender, GateRefusal(Gate.ROLE, code))

    def _change_right(self, peer: Controlled, of: str, may_stop: bool) -> None:
        """A supervisor takes from an observer the right to say stop, or gives it back; everybody hears of it."""
        present = self._present.get(of)
        if present is None:
            peer.answer(control.Refusal(label=STOP_LABEL, code="peer.lost"))
            return
        sender = present.peer.sender
        code = self._rights.change(words.party_of(peer.sender), words.party_of(sender), _account_of(sender), may_stop)
        if code is not None:
            self._refuse(peer, code)
            return
        by, whose = name_of(peer.sender), name_of(sender)
        done = "gave back to" if may_stop else "took from"
        logger.warning("%r %s %r the right to say stop", by, done, whose)
        what = "stop.right_given" if may_stop else "stop.right_taken"
        its = f"of the account {sender.operator_id}" if sender.operator_id else ""
        self._journal.note(what, who=by, account=peer.sender.operator_id, subject=whose, message=its)
        self._tell_peers()

    def _clear(self, peer: Controlled, now_s: float) -> None:
        with self.fence.lock:
            party, was_stopped = words.party_of(peer.sender), self.fence.latch.is_stopped
            code = self.fence.latch.clear(party, self.fence.desk.holds_any(party.peer_id, now_s))
        if code is not None:
            peer.answer(control.Refusal(label=STOP_LABEL, code=code))
            self._journal.refused(STOP_LABEL, peer.sender, GateRefusal(Gate.ROLE, code))
            return
        if not was_stopped:
            with self.fence.lock:
                state = words.stop_state(self.fence.latch, account=self._stop_account)
            peer.answer(state)
            return
        self._awaited.clear()
        self._stop_changed(False, peer.sender, "")

    def _stop_changed(self, is_stopped: bool, sender: Sender, reason: str) -> None:
        by, self._stop_account = name_of(sender), sender.operator_id
        with self.fence.lock:
            state = words.stop_state(self.fence.latch, by, self._stop_account)
        for peer in self._peers():
            peer.tell(state)
        # as literals: names and reasons come from outside, and a line break would forge a line of the log
        if is_stopped:
            logger.warning("stopped by %r: %r", by, reason)
        else:
            logger.warning("stop cleared by %r", by)
        self._journal.note("stop" if is_stopped else "stop.clear", who=by, account=self._stop_account, message=reason)
        self._listener.stop_changed(is_stopped, by, reason)

    def _read_journal(self, peer: Controlled, limit: int, before: int | None) -> None:
        if peer.sender.role != "supervisor":
            peer.answer(control.Refusal(label=CONTROL_LABEL, code="auth.forbidden"))
            return
        peer.answer(control.Journal(entries=self._journal.newest(limit, before)))

    # -- effects, in the order of the fence ----------------------------------------------------------------------

    def _carry_out(self, effect: lease.Effect | str) -> None:
        match effect:
            case lease.Reply(peer_id=peer_id):
                present = self._present.get(peer_id)
                if present is not None:
                    present.peer.tell(words.lease_reply(effect))
            case lease.LeaseChanged():
                self._lease_changed(effect)
            case lease.QueueChanged(resource):
                self.tell_lease(resource)
            case _ if effect == SAFE:
                self._all_safe()

    def _lease_changed(self, change: lease.LeaseChanged) -> None:
        self.tell_lease(change.resource)
        self._note_lease(change)
        holder = change.holder
        present = self._present.get(holder.peer_id) if holder is not None else None
        sender = present.peer.sender if present is not None else None
        self._listener.lease_changed(change.resource, sender, change.epoch, change.cause)

    def _note_lease(self, change: lease.LeaseChanged) -> None:
        """Write into the journal who holds a lease now, or who held it last."""
        of = change.holder or change.before
        self._journal.lease_changed()
        self._journal.note(
            "lease.granted" if change.holder is not None else "lease.ended",
            who=(of.name or of.peer_id) if of is not None else change.by,
            account=(of.account or "") if of is not None else "",
            subject=change.resource,
            code=change.cause,
            message=change.message,
        )

    def tell_lease(self, resource: str) -> None:
        """Everybody hears who holds it."""
        with self.fence.lock:
            state = words.lease_state(self.fence.desk, resource)
        for peer in self._peers():
            peer.tell(state)

    def _all_safe(self) -> None:
        awaited, self._awaited = self._awaited, {}
        for (_, stop_id), answer in awaited.items():
            with self.fence.lock:
                times = self.fence.latch.times(stop_id)
            if times is not None:
                answer(words.stop_ack(stop_id, times))
