"""Knows the operator at the other end of one peer, as far as it has said, and tells it things.

It is made before every other part of the peer: each of them can name the operator, and speak to it once it listens.
"""

from __future__ import annotations

import logging
from dataclasses import replace

from mosaic_core.contract.host import Sender
from mosaic_core.runtime.commands.link_watch import MeasuredLink
from mosaic_core.runtime.peers.control_channel import ControlChannel
from mosaic_core.runtime.peers.stop_channel import StopChannel
from mosaic_core.words.control import ControlMessage, Hello

logger = logging.getLogger(__name__)

ORDERED_PINGS_EVERY = 5


class RemoteOperator:
    """Speaks to one operator over its control channel; implements ``Controlled`` and ``Talker``. Event loop only."""

    def __init__(
        self, sender: Sender, *, is_program: bool = False, is_near: bool = False, is_local: bool = False
    ) -> None:
        """``is_near``: it came by the server that the robot runs itself, ``is_local``: over this machine's loopback."""
        self.sender = sender
        self.control_channel: ControlChannel | None = None
        """Once ``_mosaic`` is there."""
        self.stop_channel: StopChannel | None = None
        """Once ``_stop`` is."""
        self.link: MeasuredLink | None = None
        """How good its link is, once it said that it can be measured."""
        self.knows_leases = self.wants_near = False
        self._is_program = is_program
        self._is_near = is_near
        self.is_local = is_local
        self._pings = 0

    @property
    def peer_id(self) -> str:
        return self.sender.peer_id

    @property
    def name(self) -> str:
        """What people call it."""
        return self.sender.name or self.sender.peer_id

    def said_hello(self, hello: Hello) -> None:
        self.knows_leases = "lease" in hello.extensions
        self.wants_near = "near" in hello.extensions and not self._is_near
        is_person = hello.is_person and not self._is_program
        self.sender = replace(self.sender, is_person=is_person, is_original=not self.knows_leases)

    def turned_out_original(self) -> None:
        """It says no hello."""
        self.sender = replace(self.sender, is_original=True)

    def answer(self, message: ControlMessage) -> None:
        if self.control_channel is not None:
            self.control_channel.send(message)

    def tell(self, message: ControlMessage) -> None:
        if self.knows_leases:
            self.answer(message)

    def refuse(self, label: str, seq: int | None, code: str, message: str = "", gate: str = "") -> None:
        """Tell it that a message was refused, if it is an operator of ours."""
        if self.control_channel is not None:
            self.control_channel.refuse(label, seq, code, message, gate)

    def log_excess(self, why: str) -> None:
        """It made the robot keep too much, and is sent away: name the account behind it."""
        fields = {"peerId": self.peer_id, "operatorId": self.sender.operator_id, "code": "channel.too_large"}
        text = "operator %s (account %s) is disconnected, it sent too much (channel.too_large): %s"
        logger.warning(text, self.name, self.sender.operator_id or "unknown", why, extra=fields)

    def ping(self) -> None:
        """Often on the stop channel, where a lost ping is just lost; seldom on the ordered one."""
        if self.link is None:
            return
        if self.stop_channel is not None and self.stop_channel.is_open:
            self.stop_channel.send(self.link.pinged())
        elif self._pings % ORDERED_PINGS_EVERY == 0:
            self.answer(self.link.pinged())
        self._pings += 1
