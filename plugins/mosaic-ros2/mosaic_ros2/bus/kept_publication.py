"""Keeps a publication open for the robot's life, so that its subscribers have found it before the first command, and
opens it again after a failure.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from types import TracebackType
from typing import Self

from mosaic_core.contract.handler import Refused
from mosaic_core.words.errors import MosaicError
from mosaic_ros2.bus.bus import BusError, Publication
from mosaic_ros2.bus.qos import QosProfile
from mosaic_ros2.bus.shared_bus import SharedBus
from mosaic_ros2.definitions.definition import DefinitionError

_log = logging.getLogger(__name__)

RETRY_S = 2.0
JOIN_S = 1.0


class KeptPublication:
    """Publishes on one topic. Enter it with the robot; entering never fails and never blocks.

    The receiver's thread calls :meth:`send`, the safety thread :meth:`send_whatever`, a thread of its own opens it.
    """

    def __init__(self, shared: SharedBus, topic: str, type_name: str, qos: QosProfile) -> None:
        self.topic = topic
        self._shared = shared
        self._type_name = type_name
        self._qos = qos
        self._changed = threading.Condition()
        self._publication: Publication | None = None
        self._farewell: Callable[[], bytes | None] = lambda: None
        self._was_sent = False
        self._problem = "it is not open yet"
        self._is_closing = False
        self._keeper: threading.Thread | None = None

    def __enter__(self) -> Self:
        self._is_closing = False
        self._keeper = threading.Thread(target=self._keep, name=f"ros2 {self.topic}", daemon=True)
        self._keeper.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._changed:
            self._is_closing = True
            self._changed.notify_all()
        if self._keeper is not None:
            self._keeper.join(JOIN_S)

    def end_with(self, farewell: Callable[[], bytes | None]) -> None:
        """What is published last when the robot ends, if any command was."""
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
            raise Refused("plugin.no_device", f"{self.topic} is not open: {self._problem}")
        if not publication.readers and not self._qos.is_latched:
            raise Refused("plugin.no_device", f"nobody subscribes to {self.topic}; start the node that shall take it")
        self._was_sent = True
        try:
            publication.write(data)
        except BusError as error:
            raise Refused("plugin.no_device", error.message) from error

    def send_whatever(self, data: bytes) -> None:
        """Publish what brings the robot into a safe state, heard or not. Raises :class:`BusError`: to be tried
        again."""
        publication = self._publication
        if publication is not None:
            publication.write(data)

    def _keep(self) -> None:
        while True:
            try:
                opened = self._shared.joined().publish(self.topic, self._type_name, self._qos)
            except (MosaicError, DefinitionError) as error:
                with self._changed:
                    if self._problem != str(error):
                        self._problem = str(error)
                        _log.error("can't publish on %s: %s; trying again", self.topic, error)
                    if self._changed.wait_for(lambda: self._is_closing, RETRY_S):
                        return
                continue
            with self._changed:
                self._publication = opened
                self._changed.notify_all()
                self._changed.wait_for(lambda: self._is_closing)
                self._publication = None  # first: no command begins after the last message
            self._end(opened)
            return

    def _end(self, publication: Publication) -> None:
        last = self._farewell() if self._was_sent else None
        try:
            if last is not None:
                publication.write(last)
        except BusError as error:
            _log.error("the last message on %s was not taken: %s", self.topic, error)
        publication.close()
