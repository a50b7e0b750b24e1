"""The operator's half of the connector ``connection-check``: a stamp goes out twice a second and comes back."""

from __future__ import annotations

import asyncio
import json
import time
from collections import OrderedDict

from mosaic_core.machines.delivery.framing import PayloadKind
from mosaic_core.operator.delivery.data_port import MessageInfo
from mosaic_core.operator.stores.robot_connector import RobotConnector
from mosaic_core.operator.stores.stores import ReceivableStore, SendableStore
from mosaic_core.words.wire_model import to_json

PERIOD_S = 0.5
_REMEMBERED = 64
"""Answers later than half a minute are of no interest."""


class ConnectionCheckingStore(ReceivableStore, SendableStore):
    """Sends ``{"messageCreated": ms, "extra"?: text}`` on ``L-receiver``, gets it back verbatim on ``L-sender``.

    ``messageCreated`` is the wall clock, as original robots and dashboards have it; :attr:`round_trip_ms` comes from
    the monotonic clock. ``extra`` makes messages large, to time big ones.
    """

    def __init__(self, robot_connector: RobotConnector, extra: str | None = None) -> None:
        super().__init__(robot_connector)
        self.extra = extra
        self.round_trip_ms: float | None = None
        self._sent_at_s: OrderedDict[float, float] = OrderedDict()
        self._ticker: asyncio.Task[None] | None = None

    def opened(self) -> None:
        super().opened()
        if self._ticker is None:
            self._ticker = asyncio.create_task(self._tick())

    def _rest(self) -> None:
        if self._ticker is not None:
            self._ticker.cancel()
            self._ticker = None
        self._sent_at_s.clear()
        self.round_trip_ms = None

    def closed(self) -> None:
        self._rest()
        super().closed()

    def interrupted(self) -> None:
        self._rest()
        super().interrupted()

    def notify_subscribers(self, data: bytes, info: MessageInfo) -> None:
        """Read the stamp that came back, then tell the subscribers."""
        try:
            created = json.loads(data)["messageCreated"]
            sent_at_s = self._sent_at_s.pop(created, None)
        except (ValueError, LookupError, TypeError):
            sent_at_s = None
        if sent_at_s is not None:
            self.round_trip_ms = (time.monotonic() - sent_at_s) * 1e3
        super().notify_subscribers(data, info)

    async def _tick(self) -> None:
        while True:
            created_ms = time.time() * 1e3
            self._sent_at_s[created_ms] = time.monotonic()
            while len(self._sent_at_s) > _REMEMBERED:
                self._sent_at_s.popitem(last=False)
            message = {"messageCreated": created_ms} | ({"extra": self.extra} if self.extra else {})
            if self._outlet is not None:
                self._outlet(PayloadKind.STRING, to_json(message).encode())
            await asyncio.sleep(PERIOD_S)
