"""The encoders of one camera: one per codec and rung that somebody watches, none for nobody."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Mapping

import av

from mosaic_core.adapters.video.encoder_thread import EncodedRung, EncoderListener, EncoderOrder, EncoderThread

_JOIN_S = 0.5


class EncoderSet:
    """Starts and ends one camera's encoders. Event loop, but for :meth:`offer`."""

    def __init__(self, listener: EncoderListener) -> None:
        self._listener = listener
        self._threads: dict[EncodedRung, EncoderThread] = {}
        self._offered_to: tuple[EncoderThread, ...] = ()
        self._latest: av.VideoFrame | None = None
        self._skipped_before = 0
        self._told_skipped = 0
        self._cpu_before_s = 0.0
        self._encoded_before = 0

    @property
    def running(self) -> tuple[EncodedRung, ...]:
        return tuple(self._threads)

    def take_skipped(self) -> int:
        """Pictures left out since the last call, because an encoder was still busy."""
        total = self._skipped_before + sum(thread.skipped for thread in self._threads.values())
        fresh, self._told_skipped = total - self._told_skipped, total
        return fresh

    @property
    def encoded(self) -> int:
        """Pictures encoded so far, by all."""
        return self._encoded_before + sum(thread.encoded for thread in self._threads.values())

    @property
    def cpu_s(self) -> float:
        """CPU time that all encoders have used so far."""
        return self._cpu_before_s + sum(thread.cpu_s for thread in self._threads.values())

    def offer(self, picture: av.VideoFrame) -> None:
        """A prepared picture, from the handler's thread."""
        self._latest = picture
        for thread in self._offered_to:
            thread.offer(picture)

    def use(self, orders: Mapping[EncodedRung, EncoderOrder], held: Collection[EncodedRung] = ()) -> None:
        """Run exactly these encoders; a new one begins with the latest picture, as a key frame. Those ``held`` are
        given no pictures for now."""
        for key in [key for key in self._threads if key not in orders]:
            self._end(self._threads.pop(key))
        for key, order in orders.items():
            thread = self._threads.get(key)
            if thread is None:
                self._threads[key] = self._started(order)
            else:
                thread.aim_at(order.settings.bitrate_bps)
        self._offered_to = tuple(thread for key, thread in self._threads.items() if key not in held)
        if not self._threads:
            self._latest = None

    def ask_key_frame(self, key: Hashable) -> None:
        """Of one of the encoders; packets that came encoded have their own."""
        if isinstance(key, EncodedRung) and key in self._threads:
            self._threads[key].ask_key_frame()

    def close(self) -> None:
        """End all encoders and wait for them briefly: libav must not encode while the interpreter ends."""
        threads = tuple(self._threads.values())
        self.use({})
        for thread in threads:
            thread.join(_JOIN_S)

    def _started(self, order: EncoderOrder) -> EncoderThread:
        thread = EncoderThread(order, self._listener)
        if self._latest is not None:
            thread.offer(self._latest)
        return thread

    def _end(self, thread: EncoderThread) -> None:
        thread.close()
        self._skipped_before += thread.skipped
        self._cpu_before_s += thread.cpu_s
        self._encoded_before += thread.encoded
