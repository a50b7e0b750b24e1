"""Tells the store of a camera why it shows nothing, some seconds after it was opened; a picture takes that back."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass

from mosaic_core.machines.media.first_frame import FIRST_FRAME_TIMEOUT_S, first_frame_code
from mosaic_core.operator.stores.mosaic_store import MosaicStore
from mosaic_core.runtime.transport.operator_transport import IncomingVideo
from mosaic_core.words.codes import reason
from mosaic_core.words.errors import ConnectionFailed


@dataclass(slots=True)
class _Waiting:
    store: MosaicStore
    task: asyncio.Task[None]
    has_failed: bool = False


class FirstFrameWatch:
    """Watches for the first picture of each camera. Event loop only."""

    def __init__(self, timeout_s: float = FIRST_FRAME_TIMEOUT_S) -> None:
        self._timeout_s = timeout_s
        self._waiting: dict[str, _Waiting] = {}

    def began(self, label: str, store: MosaicStore, video: IncomingVideo) -> None:
        """The robot was asked for pictures."""
        self.ended(label)
        self._waiting[label] = _Waiting(store, asyncio.create_task(self._wait(label, video)))

    def arrived(self, label: str) -> None:
        """A picture: cheap, called with every one."""
        if label in self._waiting:
            waiting = self._waiting.pop(label)
            waiting.task.cancel()
            if waiting.has_failed:
                waiting.store.opened()

    def ended(self, label: str) -> None:
        """Nobody looks any more."""
        waiting = self._waiting.pop(label, None)
        if waiting is not None:
            waiting.task.cancel()

    def close(self) -> None:
        for label in list(self._waiting):
            self.ended(label)

    async def _wait(self, label: str, video: IncomingVideo) -> None:
        await asyncio.sleep(self._timeout_s)
        code = first_frame_code(await video.received())
        waiting = self._waiting.get(label)
        if code and waiting is not None:
            waiting.has_failed = True
            waiting.store.failed(ConnectionFailed(reason(code).sentence, code=code))
