"""Carries what one connector of this robot sends to a topic of ROS."""

from __future__ import annotations

import logging

from mosaic_core import DeviceGone
from mosaic_core.contract.data_tap import TappedMessage
from mosaic_core.messages import Diagnostic
from mosaic_ros2.bus.bus import Bus, BusError, NotTaken, Publication
from mosaic_ros2.bus.qos import PROFILES, QosChoice, QosProfile
from mosaic_ros2.cdr.encoding import CdrEncoder
from mosaic_ros2.connectors.bridged_types import BridgedType, compact_type
from mosaic_ros2.conversion.parts import MAX_NAME, Origin
from mosaic_ros2.definitions.definition import DefinitionError
from mosaic_ros2.definitions.type_book import TypeBook

_log = logging.getLogger(__name__)

MAX_PROBLEM = 1000


class BridgedChannel:
    """Converts, publishes and counts the messages of one connector, on one thread.

    ``kind``: ``None`` where the first message tells it, and the topic opens with that.
    """

    def __init__(
        self, label: str, topic: str, kind: BridgedType | None, qos: QosChoice, frame_id: str, book: TypeBook
    ) -> None:
        self._label = label
        self._topic = topic
        self._kind = kind
        self._chosen = qos
        self._frame_id = frame_id
        self._book = book
        self._publication: Publication | None = None
        self._encoder: CdrEncoder | None = None
        self._published = 0
        self._refused = 0
        self._problem = ""

    def open(self, bus: Bus) -> None:
        """Publish from now on, as soon as the type is known. Raises :class:`DeviceGone`."""
        if self._kind is None:
            return
        try:
            self._encoder = CdrEncoder(self._book, self._kind.type_name)
            self._publication = bus.publish(self._topic, self._kind.type_name, self._qos(self._kind))
        except DefinitionError as error:
            raise DeviceGone(str(error)) from error

    def close(self) -> None:
        """Publish no more."""
        if self._publication is not None:
            self._publication.close()

    def take(self, message: TappedMessage, bus: Bus) -> bool:
        """Publish it; ``False``: it could not become a message of ROS, or was not taken. Raises :class:`BusError` where
        the topic is lost: the connector begins anew."""
        try:
            if self._kind is None:
                self._kind = compact_type(message.payload)
            if self._publication is None:
                self._open_late(bus)
            self._publish(message, self._kind)
        except (ValueError, NotTaken) as error:  # of pydantic, of CDR, and what no number can be
            self._complain(str(error))
            return False
        self._problem = ""
        return True

    def _open_late(self, bus: Bus) -> None:
        try:
            self.open(bus)
        except BusError as error:
            raise NotTaken(error.message, error.cure) from error

    def _publish(self, message: TappedMessage, kind: BridgedType) -> None:
        """Where nobody would hear it there is nothing to do."""
        assert self._publication is not None
        assert self._encoder is not None
        if self._publication.readers or self._qos(kind).is_latched:
            value = kind.read(message.payload)
            made_at_s = getattr(value, "captured_at_s", None) or message.stamped_at_s
            origin = Origin.at(made_at_s, self._frame_id or kind.frame_id or self._label)
            self._publication.write(self._encoder.encode(kind.fields(value, origin)))
            self._published += 1

    def _qos(self, kind: BridgedType) -> QosProfile:
        """What the publication offers."""
        chosen = PROFILES["reliable" if self._chosen == "auto" else self._chosen]
        is_latched = chosen.is_latched or (self._chosen == "auto" and kind.is_whole)
        return QosProfile(chosen.is_reliable, is_latched, kind.depth)

    def _complain(self, problem: str) -> None:
        self._refused += 1
        if not self._problem:
            _log.warning("'%s': a message can't go to %s: %s", self._label, self._topic, problem)
        self._problem = problem

    def report(self) -> Diagnostic:
        """How it is, for operators."""
        readers = self._publication.readers if self._publication is not None else 0
        waits = "" if self._publication is not None else f"; '{self._label}' has sent nothing yet"
        heard = f"{readers or 'nobody'} subscribes to {self._topic}{waits}"
        counted = {"published": self._published, "refused": self._refused, "subscriptions": readers}
        return Diagnostic(
            level="error" if self._problem else "ok" if readers else "warn",
            name=f"{self._label} → {self._topic}"[:MAX_NAME],
            message=self._problem[:MAX_PROBLEM] or heard,
            values={name: str(value) for name, value in counted.items()},
        )
