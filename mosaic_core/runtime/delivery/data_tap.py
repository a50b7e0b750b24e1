"""A tap of a running robot's data: a plugin's own thread reads what connectors of this robot send and are told."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

from mosaic_core.contract.data_tap import TappedMessage
from mosaic_core.machines.delivery.backlog import Backlog
from mosaic_core.runtime.delivery.data_taps import show
from mosaic_core.runtime.delivery.outbox import Outbox
from mosaic_core.runtime.threads.tap import Tap

MAX_WAITING_BYTES = 32 * 1024 * 1024
"""As much as of a camera: a disk that writes nothing for longer is broken."""
MESSAGE_BYTES = 512
"""What a message takes in memory beside its payload."""


class RuntimeDataTap(Tap):
    """Reads data on the robot itself; a :class:`~mosaic_core.contract.data_tap.DataTap`."""

    def __init__(self, loop: asyncio.AbstractEventLoop, outbox: Outbox, labels: Sequence[str]) -> None:
        super().__init__(loop)
        self._outbox = outbox
        known = outbox.taps.channels
        self.channels = tuple(known[label] for label in dict.fromkeys(labels) if label in known)
        self._backlog: Backlog[TappedMessage] = Backlog(MAX_WAITING_BYTES)
        if any(label not in known for label in labels):
            self.failure = "channel.unknown_label"

    @property
    def dropped(self) -> int:
        """See :class:`~mosaic_core.contract.data_tap.DataTap`."""
        return self._backlog.dropped

    def next(self, timeout_s: float) -> TappedMessage | None:
        """See :class:`~mosaic_core.contract.data_tap.DataTap`."""
        with self._came:
            self._came.wait_for(lambda: len(self._backlog) or self.failure, timeout_s)
            return self._backlog.take()

    def put(self, message: TappedMessage) -> None:
        """Keep it for the reader; the oldest goes where there is too much. Event loop."""
        with self._came:
            self._backlog.put(message, len(message.payload) + MESSAGE_BYTES)
            self._came.notify_all()

    def _open(self) -> None:
        if self.failure:
            return
        for channel in self.channels:
            latched = self._outbox.tap(channel.label, self)
            if latched is not None:
                show(latched, self)

    def _close(self) -> None:
        if self.failure:
            return
        for channel in self.channels:
            self._outbox.untap(channel.label, self)
