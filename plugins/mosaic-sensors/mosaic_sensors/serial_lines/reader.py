"""Reads lines from a device and counts what is none."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator

from mosaic_core.contract.devices.refused_input import RefusedInput
from mosaic_core.contract.handler import Handler
from mosaic_core.machines.timing.pacing import TokenBucket
from mosaic_core.words.errors import DeviceGone
from mosaic_sensors.byte_source import ByteSource, FakeSource, baud_doubt, opened
from mosaic_sensors.lines import Lines
from mosaic_sensors.serial_lines.fake_device import FakeLineDevice
from mosaic_sensors.serial_lines.link import LineLink
from mosaic_sensors.serial_lines.params import LineParams


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
        self._doubt = baud_doubt(params.source, params.baud)
        self._refusals = RefusedInput(handler)

    def lines(self) -> Generator[bytes, None, None]:
        """Lines until the handler shall stop. Raises :class:`DeviceGone`."""
        try:
            with (
                opened(self._params.source, self._params.baud, self._made_up) as source,
                self._link.carried_by(source),
            ):
                yield from self._read_all(source)
        except OSError as error:
            raise DeviceGone(f"{self._params.source}: {error}") from error

    def _made_up(self) -> FakeSource:
        device = self._fake()
        return FakeSource(device.pieces(), self._handler.pause, device.hear)

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
                self.refuse(f"longer than {self._params.max_line_bytes} bytes{self._doubt}", lines.too_long - too_long)
                too_long = lines.too_long
            if found:
                heard_at_s = now_s
            elif silence_s is not None and now_s - heard_at_s > silence_s:
                raise TimeoutError(f"no line for {silence_s:g} s{self._doubt}")
            for line in found:
                if bucket.admits(now_s):
                    yield line
                else:
                    handler.count_loss("thinned")

    def refuse(self, why: object, lines: int = 1) -> None:
        """The line can't be used: counted each time, logged once in a while."""
        self._refusals.add(f"a line of {self._params.source}", why, lines)
