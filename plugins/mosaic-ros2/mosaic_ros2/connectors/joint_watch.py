"""Watches a topic of joint states, so that an arm's limits begin where it is, and a stop holds it there."""

from __future__ import annotations

import time

from mosaic_core.contract.devices.keeper import Keeper
from mosaic_core.contract.devices.kept_device import KeptDevice
from mosaic_core.words.errors import DeviceGone, MosaicError
from mosaic_ros2.bus.qos import QosProfile
from mosaic_ros2.bus.shared_bus import SharedBus
from mosaic_ros2.cdr.cursor import CdrError
from mosaic_ros2.cdr.decoding import Decoder
from mosaic_ros2.conversion.joints import positions_in

TYPE = "sensor_msgs/msg/JointState"
FRESH_S = 1.0
"""What is older is no position any more."""
WAKE_S = 0.2


class JointWatch(KeptDevice):
    """Knows where joints are. Enter it with the robot; a thread of its own reads."""

    def __init__(self, shared: SharedBus, topic: str) -> None:
        self._shared = shared
        self._topic = topic
        self._known: tuple[float, dict[str, float]] = (float("-inf"), {})
        self.keeper = Keeper(f"ros2 {topic}", self._turn)

    def positions(self) -> dict[str, float]:
        """Every joint's position, in its own unit, by its name; empty where none came lately. Any thread."""
        at_s, positions = self._known
        return positions if time.monotonic() - at_s < FRESH_S else {}

    def _turn(self) -> float:
        try:
            self._read()
        except MosaicError as error:
            raise DeviceGone(f"can't watch {self._topic}: {error}") from error
        return 0.0

    def _read(self) -> None:
        """Best effort: joint states come often, and such a subscription hears every publisher."""
        decoder = Decoder(self._shared.book, TYPE)
        subscription = self._shared.joined().subscribe(self._topic, TYPE, QosProfile(is_reliable=False, depth=1))
        self.keeper.worked()
        try:
            while not self.keeper.is_stopping:
                for arrived in subscription.take(WAKE_S):
                    try:
                        found = positions_in(decoder.decode(arrived.data))
                    except CdrError:
                        continue  # the topic is another one's to complain about
                    self._known = (time.monotonic(), {**self.positions(), **found})
        finally:
            subscription.close()
