"""What one peer says and hears about control: who it is, stop, lease, and how good its link is."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

from mosaic_core.contract.host import Sender
from mosaic_core.machines.signaling.peer_admission import PeerIdentity
from mosaic_core.runtime.commands.link_watch import MeasuredLink
from mosaic_core.runtime.peers.control_channel import ControlChannel
from mosaic_core.runtime.peers.site import Site
from mosaic_core.runtime.peers.stop_channel import StopChannel
from mosaic_core.words import control

ORDERED_PINGS_EVERY = 5


class PeerControl:
    """Implements ``control_desk.Controlled``; event loop only. :attr:`link` is set once ``_mosaic`` is there,
    :attr:`stop_link` once ``_stop`` is."""

    def __init__(self, peer_id: str, who: PeerIdentity, site: Site) -> None:
        self.sender = Sender(peer_id, who.session_id, who.operator_id, who.name, who.role)
        self.link: ControlChannel | None = None
        self.stop_link: StopChannel | None = None
        self._pings = 0
        self._is_program = who.is_program
        self._site = site
        self._knows_leases = False
        self.knows_near = False
        self._measured: MeasuredLink | None = None

    # -- who it is -----------------------------------------------------------------------------------------------

    def greeted(self, hello: control.Hello) -> None:
        """Its first hello."""
        self._knows_leases = "lease" in hello.extensions
        self.knows_near = "near" in hello.extensions
        is_person = hello.is_person and not self._is_program
        self.sender = replace(self.sender, is_person=is_person, is_original=not self._knows_leases)
        if self._knows_leases:
            self._measured = self._site.links.add(self.sender.peer_id)

    def treat_as_original(self) -> bool:
        """It knows no leases: it commands while nobody else does, or watches. ``False``: the robot takes no such."""
        self.sender = replace(self.sender, is_original=True)
        if self._site.legacy_peers == "refuse":
            return False
        self.joined()
        return True

    def joined(self) -> None:
        self._site.desk.joined(self)
        self._site.near.joined(self)

    def left(self, code: str) -> None:
        self._site.links.remove(self.sender.peer_id)
        self._site.near.left(self)
        self._site.delivery.watch(self, False)
        self._site.desk.left(self, code)

    # -- what it hears -------------------------------------------------------------------------------------------

    def tell(self, message: control.ControlMessage) -> None:
        if self._knows_leases:
            self.answer(message)

    def answer(self, message: control.ControlMessage) -> None:
        if self.link is not None:
            self.link.send(message)

    def ping(self) -> None:
        """Often on the stop channel, where a lost ping is just lost; seldom on the ordered one."""
        if self._measured is None:
            return
        if self.stop_link is not None and self.stop_link.is_open:
            self.stop_link.send(self._measured.pinged())
        elif self._pings % ORDERED_PINGS_EVERY == 0:
            self.answer(self._measured.pinged())
        self._pings += 1

    # -- what it says --------------------------------------------------------------------------------------------

    def heard(self, message: control.ControlMessage) -> None:
        """Anything but hello, bye, media.watch and what belongs to the lane or to resuming."""
        match message:
            case control.Stop():
                self.stop(message, self.answer)
            case control.Pong(t0=t0):
                if self._measured is not None:
                    self._measured.ponged(t0)
            case control.MediaSeen(label=label, capture_us=capture_us):
                if self._measured is not None and label in self._site.media.watched_by(self.sender.peer_id):
                    self._measured.picture_seen(label, capture_us)
            case control.DeliveryWatch(on=on):
                self._site.delivery.watch(self, on)
            case _:
                self._site.desk.heard(self, message, time.monotonic())

    def stop(self, stop: control.Stop, answer: Callable[[control.ControlMessage], None]) -> None:
        """``answer`` says it where the stop was heard."""
        self._site.desk.stop(self, stop, answer, time.monotonic())

    def unwatched(self, label: str) -> None:
        """It no longer looks at this picture."""
        if self._measured is not None:
            self._measured.picture_unwatched(label)
