"""Leads what one peer says about control, and its coming and going, to whom it concerns: stop, lease, link, near
path."""

from __future__ import annotations

import time

from mosaic_core.runtime.control.command_desk import TellReply
from mosaic_core.runtime.peers.remote_operator import RemoteOperator
from mosaic_core.runtime.peers.site import Site
from mosaic_core.words import control


class PeerControl:
    """Joins one operator to the command desk and takes its control messages there. Event loop only."""

    def __init__(self, operator: RemoteOperator, site: Site) -> None:
        self._operator = operator
        self._site = site

    def said_hello(self, hello: control.Hello) -> None:
        """Its first one."""
        self._operator.said_hello(hello)
        if self._operator.knows_leases:
            self._operator.link = self._site.links.add(self._operator.peer_id)

    def treat_as_original(self) -> bool:
        """It knows no leases: it commands while nobody else does, or watches. ``False``: the robot takes no such."""
        self._operator.turned_out_original()
        if self._site.legacy_peers == "refuse":
            return False
        self.operator_joined()
        return True

    def operator_joined(self) -> None:
        self._site.desk.peer_joined(self._operator)
        self._site.near.operator_joined(self._operator)

    def operator_left(self, code: str) -> None:
        self._site.links.remove(self._operator.peer_id)
        self._site.near.operator_left(self._operator)
        self._site.delivery.watch(self._operator, False)
        self._site.desk.peer_left(self._operator, code)

    def control_heard(self, message: control.ControlMessage, answer: TellReply | None = None) -> None:
        """Anything but hello, bye, media.watch and what belongs to the bulk connection or to resuming. ``answer`` says
        it where a stop was heard."""
        link = self._operator.link
        match message:
            case control.Stop():
                answer = answer or self._operator.answer
                self._site.desk.stop_heard(self._operator, message, answer, time.monotonic())
            case control.Pong(t0=t0):
                if link is not None:
                    link.ponged(t0)
            case control.MediaSeen(label=label, capture_us=capture_us):
                if link is not None and label in self._site.media.watched_by(self._operator.peer_id):
                    link.picture_seen(label, capture_us)
            case control.DeliveryWatch(on=on):
                self._site.delivery.watch(self._operator, on)
            case _:
                self._site.desk.control_heard(self._operator, message, time.monotonic())
