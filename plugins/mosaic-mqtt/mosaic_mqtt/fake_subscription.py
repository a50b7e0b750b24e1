"""Makes messages up, for whoever has no broker."""

from __future__ import annotations

import math
from collections.abc import Callable

from mosaic_mqtt.subscription import BrokerMessage

PERIOD_S = 1.0


class FakeSubscription:
    """Receives a temperature per second under a topic that fits the filter; ``pause`` is the handler's."""

    def __init__(self, topic: str, pause: Callable[[float], bool]) -> None:
        levels = ("fake" if level in ("+", "#") else level for level in topic.split("/"))
        self._topic = "/".join(levels)
        self._pause = pause
        self._count = 0

    def __enter__(self) -> FakeSubscription:
        return self

    def __exit__(self, *exception: object) -> None:
        """Nothing is open."""

    def next(self) -> BrokerMessage | None:
        """The first at once, as if it had been kept; ``None`` if the handler shall stop."""
        if self._count and self._pause(PERIOD_S):
            return None
        self._count += 1
        celsius = 20 + 5 * math.sin(self._count / 10)
        return BrokerMessage(self._topic, f'{{"celsius": {celsius:.2f}}}'.encode(), self._count == 1)
