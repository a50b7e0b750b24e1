"""Keeps a publication open for the robot's life, so that its subscribers have found it before the first command, and
opens it again when it can't be opened or fails.

Three threads meet here: a *receiver's* calls :meth:`KeptPublication.send`, the robot's *safety* thread
:meth:`KeptPublication.send_whatever`, and that of the keeper opens the publication and closes it. One that
was lost after a command owes its subscribers what makes the robot safe: they may still carry out what they heard last.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable

from mosaic_core.contract.devices.keeper import RETRY, Keeper
from mosaic_core.contract.devices.kept_device import KeptDevice
from mosaic_core.words.errors import DeviceGone, Refused
from mosaic_ros2.bus.bus import BusError, NotTaken, Publication
from mosaic_ros2.bus.qos import QosProfile
from mosaic_ros2.bus.shared_bus import SharedBus
from mosaic_ros2.bus.silence import why_unheard

_log = logging.getLogger(__name__)

OWED_S = 0.1
"""So often it is looked whether somebody hears what is owed."""


class KeptPublication(KeptDevice):
    """Publishes on one topic. Enter it with the robot; entering never fails and never blocks."""

    def __init__(self, shared: SharedBus, topic: str, type_name: str, qos: QosProfile) -> None:
        self.topic = topic
        self._shared = shared
        self._type_name = type_name
        self._qos = qos
        self._changed = threading.Condition()
        self._publication: Publication | None = None
        self._farewell: Callable[[], bytes | None] = lambda: None
        self._was_sent = False
        self._is_owing = False
        self.keeper = Keeper(f"ros2 {topic}", self._turn, retry=RETRY)

    def end_with(self, farewell: Callable[[], bytes | None]) -> None:
        """What makes the robot safe: published last when it ends, and first after a loss, if any command was."""
        self._farewell = farewell

    def wait_until_heard(self, timeout_s: float) -> bool:
        """Block until somebody subscribes; ``False`` when that took too long."""
        with self._changed:
            self._changed.wait_for(lambda: self._publication is not None, timeout_s)
        waits = threading.Event()
        rounds = max(1, int(timeout_s / 0.02))
        return any(self.readers or waits.wait(0.02) for _ in range(rounds)) and bool(self.readers)

    @property
    def readers(self) -> int:
        """How many subscriptions hear it."""
        publication = self._publication
        return publication.readers if publication is not None else 0

    def send(self, data: bytes) -> None:
        """Publish a command. Raises :class:`Refused` where nobody would hear it."""
        publication = self._publication
        if publication is None:
            raise Refused("plugin.no_device", self._not_open().message)
        try:
            if not self._is_heard(publication):
                what = why_unheard(self.topic, self._type_name, self._qos, self._shared.joined().endpoints())
                raise Refused("plugin.no_device", "; ".join(what))
            self._pay(publication)
            self._was_sent = True
            publication.write(data)
        except BusError as error:
            self._lose(publication, error)
            raise Refused("plugin.no_device", error.message) from error

    def send_whatever(self, data: bytes) -> None:
        """Publish what brings the robot into a safe state, heard or not. Raises :class:`DeviceGone`, or
        :class:`Refused` where there is no room for it: to be tried again."""
        publication = self._publication
        if publication is not None:
            try:
                publication.write(data)
            except NotTaken as error:
                raise Refused("plugin.no_device", error.message) from error
            except BusError as error:
                self._lose(publication, error)
                raise
        elif self._is_owing and not self.keeper.is_stopping:
            raise self._not_open()

    def _not_open(self) -> DeviceGone:
        absence = self.keeper.absence
        return DeviceGone(f"{self.topic} is not open{f': {absence.message}' if absence is not None else ' yet'}")

    def _is_heard(self, publication: Publication) -> bool:
        return self._qos.is_latched or publication.readers > 0

    def _pay(self, publication: Publication) -> None:
        """Publish what is owed, where somebody hears it."""
        with self._changed:
            if self._is_owing and self._is_heard(publication):
                self._say_last(publication)
                self._is_owing = False

    def _say_last(self, publication: Publication) -> None:
        last = self._farewell()
        if last is not None:
            publication.write(last)

    def _lose(self, publication: Publication, error: BusError) -> None:
        """Let the keeper open it again, unless it only was too much for its subscriptions."""
        if isinstance(error, NotTaken):
            return
        with self._changed:
            if self._publication is not publication:
                return
            self._publication = None
            self._is_owing = self._was_sent
        self.keeper.lost(error)

    def _turn(self) -> float:
        """Open it and wait until it is lost, or the robot ends."""
        publication = self._opened()
        self._attend(publication)
        self._end(publication)
        return self.keeper.failed()

    def _opened(self) -> Publication:
        try:
            return self._shared.joined().publish(self.topic, self._type_name, self._qos)
        except Exception as error:  # middlewares raise whatever comes of a network
            raise DeviceGone(str(error)) from error

    def _attend(self, publication: Publication) -> None:
        self.keeper.worked()
        with self._changed:
            self._publication = publication
            self._changed.notify_all()
        while self._publication is publication and not self.keeper.wait(OWED_S if self._is_owing else None):
            try:
                self._pay(publication)
                self.keeper.worked()  # whoever found it gone may have meant one that was closed
            except BusError as error:
                self._lose(publication, error)
        self._publication = None  # first: no command begins after the last message

    def _end(self, publication: Publication) -> None:
        try:
            if self.keeper.is_stopping and self._was_sent:
                self._say_last(publication)
        except BusError as error:
            _log.error("the last message on %s was not taken: %s", self.topic, error)
        try:
            publication.close()
        except Exception as error:  # noqa: BLE001 - as above: what was lost may not even end in order
            _log.warning("the publication on %s did not end in order: %s", self.topic, error)
