"""Pictures from the handlers to the peers: converted once on the handler's thread, the newest kept for each viewer.

Nobody watching: nothing is converted, and a ``watched`` handler does not run.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable
from typing import Any

from mosaic_core.contract.media import Captured, Picture
from mosaic_core.runtime.counters import ConnectorCounters
from mosaic_core.runtime.handover import Handover
from mosaic_core.runtime.transport import PicturePreparer

_MAX_PACKETS = 60
"""Encoded packets that wait for one viewer: two seconds at 30 fps, then it starts over at a key frame."""


class NewestFeed:
    """Where one viewer's track takes its pictures from. Event loop only."""

    def __init__(self) -> None:
        self._items: deque[Any] = deque()
        self._arrived = asyncio.Event()
        self._waits_for_key = True
        self.dropped = 0

    async def next(self) -> Any:
        while not self._items:
            self._arrived.clear()
            await self._arrived.wait()
        return self._items.popleft()

    def put(self, item: Any) -> None:
        """A frame replaces one that waits; encoded packets build on each other, so they queue from a key frame on."""
        is_key: bool | None = getattr(item, "is_keyframe", None)
        if is_key is None:
            self.dropped += len(self._items)
            self._items.clear()
        elif is_key:
            self._waits_for_key = False
            if len(self._items) >= _MAX_PACKETS:
                self.dropped += len(self._items)
                self._items.clear()
        elif self._waits_for_key or len(self._items) >= _MAX_PACKETS:
            self.dropped += 1 + (0 if self._waits_for_key else len(self._items))
            self._items.clear()
            self._waits_for_key = True
            return
        self._items.append(item)
        self._arrived.set()

    def clear(self) -> None:
        """The viewer paused: what waits is old by the time it looks again."""
        self._items.clear()
        self._waits_for_key = True


class MediaHub:
    """Of one robot. ``watched``: told on the loop when a label gets its first or loses its last viewer."""

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        prepare: PicturePreparer,
        watched: Callable[[str, bool], None],
    ) -> None:
        self._prepare = prepare
        self._watched = watched
        self._handover: Handover[tuple[str, Any]] = Handover(loop, self._distribute, max_items=256)
        self._counters: dict[str, ConnectorCounters] = {}
        self._feeds: dict[tuple[str, str], NewestFeed] = {}
        self._viewers: dict[str, frozenset[str]] = {}

    def add_label(self, label: str, counters: ConnectorCounters) -> None:
        self._counters[label] = counters
        self._viewers[label] = frozenset()

    def post(self, label: str, picture: Picture) -> bool:
        """Any thread; converts here. ``False`` if nobody watches. Raises what the conversion raises."""
        if not self._viewers.get(label):
            return False
        captured_at_s = picture.captured_at_s if isinstance(picture, Captured) else time.monotonic()
        return self._handover.put((label, self._prepare(picture, captured_at_s)))

    # -- on the event loop ---------------------------------------------------------------------------------------

    def bind(self, peer_id: str, label: str) -> NewestFeed:
        """The peer has a track for ``label``; its feed is silent until :meth:`watch`."""
        return self._feeds.setdefault((peer_id, label), NewestFeed())

    def is_bound(self, peer_id: str, label: str) -> bool:
        return (peer_id, label) in self._feeds

    def watch(self, peer_id: str, label: str, on: bool) -> None:
        """Let pictures of ``label`` flow to the peer, or stop them."""
        before = self._viewers[label]
        after = before | {peer_id} if on else before - {peer_id}
        if after == before:
            return
        self._viewers[label] = after
        if not on and (feed := self._feeds.get((peer_id, label))) is not None:
            feed.clear()
        if bool(before) != bool(after):
            self._watched(label, bool(after))

    def leave(self, peer_id: str) -> None:
        """The peer is gone."""
        for label in self._viewers:
            self.watch(peer_id, label, False)
        for key in [key for key in self._feeds if key[0] == peer_id]:
            del self._feeds[key]

    def labels(self) -> tuple[str, ...]:
        """In the order of the YAML file."""
        return tuple(self._viewers)

    def viewers(self, label: str) -> int:
        return len(self._viewers.get(label, ()))

    def watched_by(self, peer_id: str) -> tuple[str, ...]:
        return tuple(label for label, viewers in self._viewers.items() if peer_id in viewers)

    def _distribute(self, item: tuple[str, Any]) -> None:
        label, prepared = item
        counters = self._counters[label]
        for peer_id in self._viewers[label]:
            feed = self._feeds.get((peer_id, label))
            if feed is not None:
                before = feed.dropped
                feed.put(prepared)
                counters.dropped += feed.dropped - before
        counters.count(getattr(prepared, "size", 0), time.monotonic())  # a packet knows its bytes, a frame has none
