"""The messages of the control channel that say who commands, made from what the machines know."""

from __future__ import annotations

from mosaic_core.contract.host import Sender
from mosaic_core.machines.commands.slow_down import Cause
from mosaic_core.machines.control.lease_desk import LeaseDesk
from mosaic_core.machines.control.lease_events import Party, Reply
from mosaic_core.machines.control.stop_latch import StopLatch, StopTimes
from mosaic_core.machines.control.stop_rights import UNCHANGED, RightToStop
from mosaic_core.words import control
from mosaic_core.words.codes import REASONS
from mosaic_core.words.control import Role


def party_of(sender: Sender) -> Party:
    commanding: tuple[Role, ...] = ("operator", "supervisor")
    role: Role = next((known for known in commanding if known == sender.role), "observer")
    is_person, is_original, account = sender.is_person, sender.is_original, sender.operator_id or None
    return Party(sender.peer_id, sender.session_id, sender.name, role, is_person, is_original, account)


def peer_info(party: Party, right: RightToStop = UNCHANGED) -> control.PeerInfo:
    info = control.PeerInfo.model_validate(party, from_attributes=True)
    if right == UNCHANGED:
        return info
    may_stop = None if right.may_stop else False
    return info.model_copy(update={"may_stop": may_stop, "stop_right_by": right.changed_by})


def lease_reply(reply: Reply) -> control.LeaseReply:
    sentence = REASONS[reply.code].sentence if reply.code in REASONS else None
    return control.LeaseReply(
        resource=reply.resource,
        outcome=reply.outcome,
        epoch=reply.epoch,
        code=reply.code,
        message=reply.message or sentence,
    )


def lease_state(desk: LeaseDesk, resource: str) -> control.LeaseState:
    holder = desk.holder(resource)
    return control.LeaseState(
        resource=resource,
        epoch=desk.epoch(resource),
        holder=peer_info(holder) if holder else None,
        queue=tuple(
            control.LeaseWaiting(
                peer_id=one.party.peer_id, name=one.party.name, reason=one.reason, is_person=one.party.is_person
            )
            for one in desk.queue(resource)
        ),
        expiry_s=desk.expiry_s,
    )


def stop_state(latch: StopLatch, by: str = "", account: str = "") -> control.StopState:
    """``by``: who cleared it; of a stop the latch knows. ``account``: of whoever stopped or cleared it."""
    since_us = None if latch.since_s is None else int(latch.since_s * 1e6)
    return control.StopState(
        is_stopped=latch.is_stopped,
        by=latch.by or by,
        by_account=account or None,
        reason=latch.reason,
        since_us=since_us,
    )


def stop_ack(stop_id: str, times: StopTimes) -> control.StopAck:
    safe_us = None if times.safe_s is None else int(times.safe_s * 1e6)
    return control.StopAck(id=stop_id, received_us=int(times.received_s * 1e6), safe_us=safe_us)


def safety_limit(label: str, factor: float, causes: tuple[Cause, ...]) -> control.SafetyLimit:
    return control.SafetyLimit(
        label=label,
        factor=factor,
        causes=tuple(control.SafetyCause(cause=one.cause, value=one.value, factor=one.factor) for one in causes),
    )
