"""What a handler hears and can't use: counted each time, logged once in a while."""

from __future__ import annotations

import logging

from mosaic_core.contract.handler import Handler
from mosaic_core.machines.timing.pacing import ComplaintPace


class RefusedInput:
    """Counts input that makes no sense as refused, and tells of it in the log of the handler's module. One thread."""

    def __init__(self, handler: Handler) -> None:
        self._handler = handler
        self._log = logging.getLogger(type(handler).__module__)
        self._pace = ComplaintPace()

    def add(self, what: str, why: object, count: int = 1) -> None:
        """Refuse ``what``, such as ``a line of /dev/ttyUSB0``; of several the last one's reason is told."""
        self._handler.count_loss("refused", count)
        if self._pace.is_due("refused", self._handler.monotonic_s()):
            self._log.warning("%s: refused %s: %s", self._handler.label, what, why)
