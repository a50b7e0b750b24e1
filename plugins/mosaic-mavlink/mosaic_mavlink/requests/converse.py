"""Holds a conversation with a vehicle on the thread of the request: sends, waits, tells progress, answers."""

from __future__ import annotations

from typing import Any

from mosaic_core.contract.handler import Refused
from mosaic_core.contract.request_handler import Request
from mosaic_mavlink.link.contact import VehicleContact
from mosaic_mavlink.requests.conversation import (
    Concluded,
    Conversation,
    Effect,
    NotConcluded,
    SendMessage,
    ShowProgress,
)

LOOK_S = 0.1
"""Longest wait before it is looked whether the request was taken back, or the vehicle is gone."""


def conversed(contact: VehicleContact, conversation: Conversation, request: Request) -> Any:
    """The result of ``conversation``. Raises :class:`Refused` with the reason where there is none."""
    with contact.vehicle.listening(conversation.listens) as inbox:
        effects = conversation.begin(contact.now_s())
        while True:
            for effect in effects:
                if isinstance(effect, Concluded):
                    return effect.result
                _carry_out(contact, effect, request)
            if request.is_cancelled:
                for effect in conversation.cancel():
                    _carry_out(contact, effect, request)
                raise Refused("request.cancelled", "the request was taken back")
            contact.facts()
            message = inbox.take(min(LOOK_S, conversation.deadline_s - contact.now_s()))
            now_s = contact.now_s()
            is_ours = message is not None and contact.is_for_us(message)
            heard = conversation.hear(message, now_s) if is_ours else []
            effects = heard or conversation.time_passed(now_s)


def _carry_out(contact: VehicleContact, effect: Effect, request: Request) -> None:
    match effect:
        case SendMessage(message):
            if not contact.send(message):
                raise Refused("plugin.no_device", "the link is lost; opening it again")
        case ShowProgress(done, total, said):
            told = {"done": done, "total": total, "said": said or None}
            request.progress({key: value for key, value in told.items() if value is not None})
        case NotConcluded(code, message):
            raise Refused(code, message)
