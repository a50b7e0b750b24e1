"""A thread that reads a source, so that a read that hangs for seconds never holds up the handler.

Pictures that a lower rate leaves out are never decoded. Of a live source only the newest picture is kept: latency
can't accumulate. A recording waits until each is taken. Live packets build on each other and queue; if nobody takes
them, they begin anew at a key frame.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable

from mosaic_camera.grabbed import Grabbed, takes_all
from mosaic_camera.source import Source
from mosaic_core.machines.timing.pacing import GridThinning

JOIN_S = 0.5
"""A read may hang in a driver. The thread is then left to close the source by itself when the read returns."""
MAX_WAITING = 60
"""Live packets: two seconds."""


class Grabber:
    """Opens the source on its own thread between enter and exit; :meth:`next` hands over at most ``fps`` pictures per
    second of the source's time (``None``: every one; packets: always every one)."""

    def __init__(
        self, open_source: Callable[[], Source], *, is_looping: bool, name: str, fps: float | None = None
    ) -> None:
        self._open_source = open_source
        self._takes = takes_all if fps is None else GridThinning(fps).takes
        self._is_looping = is_looping
        self._changed = threading.Condition()
        self._waiting: deque[Grabbed] = deque()
        self._keeps_order = False
        self._is_torn = False
        self._error: BaseException | None = None
        self._is_live = True
        self._count = 0
        self._garbled = 0
        self._is_stopping = False
        self._has_ended = False
        self._thread = threading.Thread(target=self._run, name=f"grab {name}", daemon=True)

    @property
    def has_ended(self) -> bool:
        """A recording is over, or a live source is lost; pictures may still wait."""
        return self._has_ended and not self._waiting

    @property
    def keeps_order(self) -> bool:
        """Its pictures are packets; known once the first one came."""
        return self._keeps_order

    @property
    def count(self) -> int:
        """Pictures read so far, with those that were left out."""
        return self._count

    def take_garbled(self) -> int:
        """How many pictures were garbage since the last call. They are no sign of life."""
        with self._changed:
            garbled, self._garbled = self._garbled, 0
            return garbled

    @property
    def is_live(self) -> bool:
        """Known once the first picture came."""
        return self._is_live

    def __enter__(self) -> Grabber:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        with self._changed:
            self._is_stopping = True
            self._changed.notify_all()
        self._thread.join(JOIN_S)

    def next(self, timeout_s: float) -> Grabbed | None:
        """The picture that waits, or comes within ``timeout_s``; raises what the source raised."""
        with self._changed:
            self._changed.wait_for(lambda: self._waiting or self._has_ended, timeout_s)
            grabbed = self._waiting.popleft() if self._waiting else None
            self._changed.notify_all()
            if grabbed is None and self._error is not None:
                raise self._error
            return grabbed

    def _run(self) -> None:
        try:
            source = self._open_source()
            try:
                self._is_live, self._keeps_order = source.is_live, source.keeps_order
                self._read_all(source)
            finally:
                source.close()
        except Exception as error:  # noqa: BLE001 - whatever a driver raises belongs to the body, which next() reaches
            self._error = error
        finally:
            with self._changed:
                self._has_ended = True
                self._changed.notify_all()

    def _read_all(self, source: Source) -> None:
        read_this_turn = 0
        while not self._is_stopping:
            grabbed = source.read(self._takes)
            if grabbed is not None and grabbed.is_garbled:
                with self._changed:
                    self._garbled += 1
            elif grabbed is not None:
                read_this_turn += 1
                self._count += 1
                if grabbed.image is not None:
                    self._hand_over(grabbed)
            elif self._is_looping and not source.is_live and read_this_turn:
                read_this_turn = 0
                source.rewind()
            else:
                return

    def _hand_over(self, grabbed: Grabbed) -> None:
        with self._changed:
            if not self._is_live:
                self._changed.wait_for(lambda: not self._waiting or self._is_stopping)
            elif not self._keeps_order:
                self._waiting.clear()
            elif len(self._waiting) >= MAX_WAITING:
                self._waiting.clear()
                self._is_torn = True
            self._is_torn = self._is_torn and not grabbed.is_key
            if not self._is_torn:
                self._waiting.append(grabbed)
            self._changed.notify_all()
