"""Reads lines from a device and counts what is none."""

from __future__ import annotations

import logging
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager

from mosaic_core.contract.handler import Handler
from mosaic_core.machines.timing.pacing import ComplaintPace, TokenBucket
from mosaic_core.words.errors import DeviceGone
from mosaic_sensors.byte_source import FAKE, ByteSource, FakeSource, is_serial, opened
from mosaic_sensors.lines import Lines
from mosaic_sensors.serial_lines.fake_device import FakeLineDevice
from mosaic_sensors.serial_lines.link import LineLink
from mosaic_sensors.serial_lines.params import LineParams

_log = logging.getLogger(__name__)


class LineReader:
    """Reads the lines of one device for ``handler``, on the handler's own thread. ``fake`` makes the device that is
    made up."""

    def __init__(
        self, handler: Handler, params: LineParams, link: LineLink, fake: Callable[[], FakeLineDevice]
    ) -> None:
        self._handler = handler
        self._params = params
        self._link = link
        self._fake = fake
        self._complaints = ComplaintPace()

    def lines(self) -> Generator[bytes, None, None]:
        """Lines until the handler shall stop. Raises :class:`DeviceGone`."""
        try:
            with self._opened() as source, self._link.carried_by(source):
                yield from self._read_all(source)
        except OSError as error:
            raise DeviceGone(f"{self._params.source}: {error}") from error

    @contextmanager
    def _opened(self) -> Iterator[ByteSource]:
        if self._params.source == FAKE:
            device = self._fake()
            yield FakeSource(device.pieces(), self._handler.pause, device.hear)
            return
        with opened(self._params.source, self._params.baud) as source:
            yield source

    def _read_all(self, source: ByteSource) -> Iterator[bytes]:
        handler, silence_s = self._handler, self._params.silence_s
        lines, bucket = Lines(self._params.max_line_bytes), TokenBucket.of_rate(self._params.max_rate_hz)
        heard_at_s, too_long = handler.monotonic_s(), 0
        while not handler.is_stopping:
            found = lines.feed(source.read())
            now_s = handler.monotonic_s()
            if self._link.failure is not None:
                raise self._link.failure
            if lines.too_long > too_long:
                self.refuse(f"longer than {self._params.max_line_bytes} bytes{self._hint}", lines.too_long - too_long)
                too_long = lines.too_long
            if found:
                heard_at_s = now_s
            elif silence_s is not None and now_s - heard_at_s > silence_s:
                raise TimeoutError(f"no line for {silence_s:g} s{self._hint}")
            for line in found:
                if bucket.admits(now_s):
                    yield line
                else:
                    handler.count_loss("thinned")

    def refuse(self, why: object, lines: int = 1) -> None:
        """The line can't be used: counted each time, logged once in a while."""
        self._handler.count_loss("refused", lines)
        if self._complaints.is_due("refused", self._handler.monotonic_s()):
            _log.warning("%s: refused a line of %s: %s", self._handler.label, self._params.source, why)

    @property
    def _hint(self) -> str:
        return f"; is {self._params.baud} the right baud rate?" if is_serial(self._params.source) else ""
