"""Sends a store's messages on a reliable channel: at once where that is possible, kept while there is no connection."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Literal

from mosaic_core.machines.delivery.framing import Frame, PayloadKind
from mosaic_core.machines.delivery.resume import ResumeSender
from mosaic_core.operator.delivery.data_port import DataPort

MESSAGE_BYTES = 64
"""What an empty message costs us: a queue of nothing else is bounded too."""


class OutgoingStream:
    """Sends, keeps and repeats what one label's store says. Event loop only. Until the robot has said what it takes
    part in, messages wait.
    """

    def __init__(self, clock_us: Callable[[], int], *, waits: bool) -> None:
        self._clock_us = clock_us
        self._waits = waits
        self._sender: ResumeSender[Frame] = ResumeSender()
        self._phase: Literal["held", "resumed", "plain", "away", "closed"] = "held"
        self._port: DataPort | None = None

    @property
    def is_numbered(self) -> bool:
        """Its numbers go on."""
        return self._phase not in ("plain", "closed")

    @property
    def upcoming(self) -> int:
        """The number that comes first on the next connection."""
        return self._sender.first_seq

    @property
    def waiting(self) -> int:
        """Messages that are kept for a connection."""
        return self._sender.waiting if self._sender.is_attached else self._sender.unconfirmed

    def send(self, kind: PayloadKind, payload: bytes) -> bool:
        """Whether it was accepted."""
        port = self._port
        if self._phase == "plain" and self._sender.waiting == 0:
            return port is not None and port.send(kind, payload)
        if self._phase == "closed" or (port is None and not self._waits):
            return False
        frame = Frame(kind, payload, stamp_us=self._clock_us()) if port is None else port.frame(kind, payload)
        size_bytes, now_s = len(payload) + MESSAGE_BYTES, time.monotonic()
        if not self._sender.has_room(size_bytes, now_s):
            return False
        if port is not None and self._phase == "resumed" and self._sender.waiting == 0:
            if not port.put(replace(frame, seq=self._sender.next_seq)):
                return False
            self._sender.accept(frame, size_bytes, now_s)
            self._sender.went_out()
            return True
        self._sender.accept(frame, size_bytes, now_s)
        self.pump()
        return True

    def attach(self, port: DataPort) -> None:
        self._port = port
        self.pump()

    def detach(self) -> None:
        self._port = None

    def released(self) -> None:
        """Its store is gone, and what it still wanted to say."""
        self._port = None
        self._sender.abandoned()

    def pump(self) -> None:
        """Send what waits, as far as the channel takes it; called again when that has drained."""
        while self._port is not None and (numbered := self._sender.upcoming()) is not None:
            frame, is_plain = numbered.item, self._phase == "plain"
            if not self._leaves(self._port, frame, None if is_plain else numbered.seq):
                return
            self._sender.went_out()
            if is_plain:
                self._sender.delivered(numbered.seq)

    @staticmethod
    def _leaves(port: DataPort, frame: Frame, seq: int | None) -> bool:
        """``seq`` of ``None``: under the channel's own number."""
        return port.send(frame.kind, frame.payload) if seq is None else port.put(replace(frame, seq=seq))

    def delivered(self, seq: int) -> None:
        self._sender.delivered(seq)

    def leaving(self) -> None:
        """A good-bye comes next, after which nobody confirms anything: the transport knows what has arrived."""
        if self._port is not None and self._sender.waiting == 0 and self._port.has_arrived:
            self._sender.all_delivered()

    def lost(self) -> None:
        """The connection is gone and will be made anew."""
        self._port = None
        self._sender.detached()
        self._phase = "away"

    def resumed(self, received: int | None) -> int:
        """The robot has everything up to ``received``. How many messages are lost by now."""
        self._phase = "resumed"
        self._sender.forget_old(time.monotonic())
        lost = self._sender.resumed(received)
        self.pump()
        return lost

    def plain(self) -> int:
        """The robot does not number it across connections: what waits goes out once, what went out is not repeated,
        and nothing is kept any more while there is no connection."""
        self._phase, self._waits = "plain", False
        self._sender.forget_old(time.monotonic())
        lost = self._sender.resumed(None)
        self.pump()
        return lost

    def close(self) -> int:
        """It has ended for good. How many messages may not have arrived."""
        self._phase, self._port = "closed", None
        return self._sender.abandoned()
