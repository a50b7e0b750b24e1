"""A motor and a camera for tests that need one, and not more of it than that it is there."""

from __future__ import annotations

import threading
from typing import Any

from mosaic_core import DataChannelJsonReceivable
from mosaic_core.contract.handler import MediaTrackHandler
from support.waiting import PATIENCE_S


class Motor(DataChannelJsonReceivable):
    """Takes ``{"v": …}``. ``log``: values and causes of safe actions, as they came. Clear ``free``, and ``handle_data``
    hangs after its entry; clear ``may_stop``, and the safe action does."""

    def __init__(self, label: str = "drive", *, timeout_s: float | None = 30.0, requires_lease: bool = False) -> None:
        super().__init__(label)
        self.timeout_s = timeout_s
        self.requires_lease = requires_lease
        self.log: list[Any] = []
        self.free, self.may_stop = threading.Event(), threading.Event()
        self.free.set()
        self.may_stop.set()

    def handle_data(self, data: dict[str, Any]) -> None:
        self.log.append(data["v"])
        self.free.wait(PATIENCE_S)

    def make_safe(self, cause: str) -> None:
        self.log.append(cause)
        self.may_stop.wait(PATIENCE_S)


class Camera(MediaTrackHandler):
    """Is there to be offered; nobody asks it for a picture."""
