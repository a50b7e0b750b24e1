"""Listens to one topic on the thread of a handler: finds its publishers, agrees on type and quality of service, hands
over what comes, and says why nothing does.
"""

from __future__ import annotations

import time
from collections.abc import Iterator

from mosaic_core import DeviceGone
from mosaic_core.contract.devices.refused_input import RefusedInput
from mosaic_core.contract.handler import Handler
from mosaic_ros2.bus.bus import Arrived, Bus, HeardEndpoint, Subscription
from mosaic_ros2.bus.qos import PROFILES, QosProfile, fitting, misfits
from mosaic_ros2.bus.shared_bus import SharedBus
from mosaic_ros2.bus.silence import why_other_type, why_silent, why_unfit, why_unmatched
from mosaic_ros2.connectors.params import ReadsTopicParams
from mosaic_ros2.definitions.definition import DefinitionError

WAKE_S = 0.2
"""How long one waits before one looks whether the handler shall stop."""
LOOK_S = 0.05
RECHECK_S = 5.0
"""How often publishers who came later are looked at: a new one may offer less."""
_LATE_S = 5.0
"""A publisher's stamp that is older is no age but another clock."""


class TopicListener:
    """One topic as a handler listens to it. All of it runs on the handler's thread."""

    def __init__(
        self,
        handler: Handler,
        shared: SharedBus,
        params: ReadsTopicParams,
        type_name: str,
        *,
        newest_only: bool = False,
    ) -> None:
        """``type_name``: empty: whatever the topic's publishers have. ``newest_only``: of messages that wait together
        the last one comes, and the others are counted as replaced."""
        self._handler = handler
        self._shared = shared
        self._params = params
        self.type_name = type_name
        self.topic = params.topic
        self._newest_only = newest_only
        self._refusals = RefusedInput(handler)

    def arrivals(self) -> Iterator[Arrived | None]:
        """What comes, for as long as the handler runs; ``None`` now and then while nothing does, so that whoever has
        kept something can send it. Raises :class:`DeviceGone` where nobody publishes, with the reason."""
        bus = self._shared.joined()
        publishers = self._publishers(bus)
        self._agree_on_type(bus, publishers)
        while not self._handler.is_stopping:
            qos = self._profile(publishers)
            try:
                subscription = bus.subscribe(self.topic, self.type_name, qos)
            except DefinitionError as error:
                raise DeviceGone(str(error)) from error
            try:
                yield from self._received(bus, subscription, qos)
            finally:
                subscription.close()
            publishers = self._heard(bus)

    def _received(self, bus: Bus, subscription: Subscription, qos: QosProfile) -> Iterator[Arrived | None]:
        """Until a publisher comes that this subscription can't hear."""
        heard_s = checked_s = self._handler.monotonic_s()
        while not self._handler.is_stopping:
            batch = subscription.take(WAKE_S)
            if self._newest_only and len(batch) > 1:
                self._handler.count_loss("replaced", len(batch) - 1)
                batch = batch[-1:]
            yield from batch
            if batch:
                heard_s = self._handler.monotonic_s()
                continue
            yield None
            now_s = self._handler.monotonic_s()
            if subscription.publishers:
                heard_s = now_s
            elif now_s - heard_s >= self._params.silence_s:
                raise DeviceGone(*self._reason(bus))
            if now_s - checked_s >= RECHECK_S:
                checked_s = now_s
                if self._params.qos == "auto" and any(misfits(one.qos, qos) for one in self._heard(bus)):
                    return

    def _reason(self, bus: Bus) -> tuple[str, str]:
        """Why nobody is heard who was, or should be."""
        publishers = self._heard(bus)
        return (
            why_unmatched(self.topic, publishers) if publishers else why_silent(self.topic, bus.where, bus.endpoints())
        )

    def _heard(self, bus: Bus) -> list[HeardEndpoint]:
        return [one for one in bus.endpoints() if one.role == "publisher" and one.name == self.topic]

    def _publishers(self, bus: Bus) -> list[HeardEndpoint]:
        """Those of the topic, once there are any."""
        until_s = self._handler.monotonic_s() + self._params.silence_s
        while not (found := self._heard(bus)):
            if self._handler.monotonic_s() >= until_s:
                raise DeviceGone(*why_silent(self.topic, bus.where, bus.endpoints()))
            if self._handler.pause(LOOK_S):
                break
        return found

    def _agree_on_type(self, bus: Bus, publishers: list[HeardEndpoint]) -> None:
        if not self.type_name and publishers:
            self.type_name = publishers[0].type
            if not self._shared.book.knows(self.type_name):
                bus.learn_type(self.topic)
        problem = why_other_type(self.topic, self.type_name, publishers) if publishers else None
        if problem is not None:
            raise DeviceGone(*problem)

    def _profile(self, publishers: list[HeardEndpoint]) -> QosProfile:
        if self._params.qos == "auto":
            return fitting([one.qos for one in publishers], self._params.depth)
        chosen = PROFILES[self._params.qos]
        asked = QosProfile(chosen.is_reliable, chosen.is_latched, self._params.depth or chosen.depth)
        problem = why_unfit(self.topic, asked, publishers)
        if problem is not None:
            raise DeviceGone(*problem)
        return asked

    def refuse(self, error: Exception) -> None:
        """A message that makes no sense: counted each time, logged once in a while."""
        self._refusals.add(f"a message of {self.topic}", error)

    def captured_at_s(self, arrived: Arrived) -> float:
        """When it was sent, on the robot's monotonic clock; now, where the publisher's clock makes no sense."""
        age_s = (time.time_ns() - arrived.sent_at_ns) / 1e9 if arrived.sent_at_ns else 0.0
        return self._handler.monotonic_s() - (age_s if 0.0 <= age_s < _LATE_S else 0.0)
