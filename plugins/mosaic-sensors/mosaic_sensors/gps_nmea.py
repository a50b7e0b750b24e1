"""The ``gps-nmea`` connector: positions of any receiver that speaks NMEA 0183, live or recorded."""

from __future__ import annotations

import logging
from collections.abc import Generator, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any, ClassVar

from pydantic import Field, field_validator

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import DataChannelSendable
from mosaic_core.contract.params import Params, unit
from mosaic_core.messages import GpsFix, wall_time_us
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.errors import DeviceGone
from mosaic_sensors.byte_source import baud_doubt, is_serial, is_tcp, opened, tcp_address
from mosaic_sensors.lines import Lines
from mosaic_sensors.nmea import NmeaPosition, PositionTracker, parsed
from mosaic_sensors.nmea_stream import Pace

_log = logging.getLogger(__name__)

SAMPLE = Path(__file__).with_name("sample_walk.nmea")
REPLAY_AGAIN_S = 1.0
"""Between two rounds of a recording."""


class GpsNmeaParams(Params):
    source: str = Field(
        default="/dev/ttyUSB0",
        min_length=1,
        description="/dev/tty… or COM3: a serial port; tcp://host:port: raw NMEA over TCP; `sample`: a "
        "walk that was recorded, to try it; else a recorded file.",
    )
    baud: int = Field(default=9600, gt=0, description="Speed of the serial port.")
    silence_s: float = Field(default=10.0, gt=0, description="Open it again when no sentence came for so long.")
    loop: bool = Field(default=True, description="Play a recorded file again and again.")

    @field_validator("source")
    @classmethod
    def _address(cls, source: str) -> str:
        if is_tcp(source):
            tcp_address(source)
        elif "://" in source:
            raise ValueError(f"{source!r} is no source; write tcp://host:port, a serial port, or a file")
        return source


class GpsPosition(GpsFix):
    """The position that a receiver tells; null: it does not say."""

    satellites: int | None = None
    hdop: float | None = Field(default=None, json_schema_extra=unit(""))
    vdop: float | None = Field(default=None, json_schema_extra=unit(""))
    speed_mps: float | None = Field(default=None, json_schema_extra=unit("m/s"))
    course_rad: float | None = Field(default=None, json_schema_extra=unit("rad"))
    bad_lines: int = Field(default=0, description="Lines since the start that were no valid sentence.")


class GpsNmea(DataChannelSendable[GpsPosition]):
    """Sends a position per epoch of a GPS receiver, also without a fix."""

    delivery: ClassVar[Delivery] = Delivery.LATEST

    def __init__(self, label: str, params: GpsNmeaParams) -> None:
        super().__init__(label)
        self.params = params

    def messages(self) -> Iterator[GpsPosition]:
        tracker = PositionTracker()
        is_live = is_tcp(self.params.source) or is_serial(self.params.source)
        with closing(self._live() if is_live else self._recorded()) as sentences:
            for sentence in sentences:
                position = tracker.feed(sentence)
                if sentence is None:
                    self.count_loss("refused")
                    if tracker.bad_lines == 1:
                        _log.info("%s: skipped a line of %s that is no NMEA sentence", self.label, self.params.source)
                if position is not None:
                    yield _message(position, tracker.bad_lines)

    def _live(self) -> Generator[Any, None, None]:
        try:
            yield from self._heard()
        except OSError as error:
            raise DeviceGone(f"{self.params.source}: {error}") from error

    def _heard(self) -> Generator[Any, None, None]:
        lines = Lines()
        heard_at_s = self.monotonic_s()
        with opened(self.params.source, self.params.baud) as source:
            while not self.is_stopping:
                too_long_before = lines.too_long
                whole = lines.feed(source.read())
                yield from [None] * (lines.too_long - too_long_before)
                for line in whole:
                    sentence = parsed(line)
                    if sentence is not None:
                        heard_at_s = self.monotonic_s()
                    yield sentence
                if self.monotonic_s() - heard_at_s > self.params.silence_s:
                    doubt = baud_doubt(self.params.source, self.params.baud)
                    raise TimeoutError(f"no NMEA sentence for {self.params.silence_s:g} s{doubt}")

    def _recorded(self) -> Generator[Any, None, None]:
        while True:
            pace = Pace()
            with recorded_file(self.params.source).open("rb") as recording:
                for line in recording:
                    sentence = parsed(line)
                    wait_s = pace.wait_s(sentence)
                    if wait_s > 0 and self.pause(wait_s):
                        return
                    yield sentence
            if not self.params.loop or self.pause(REPLAY_AGAIN_S):
                return


def recorded_file(source: str) -> Path:
    """The file of a recording; ``sample`` is the one that this package brings."""
    return SAMPLE if source == "sample" else Path(source)


def _message(position: NmeaPosition, bad_lines: int) -> GpsPosition:
    utc_us = round(position.time_utc.timestamp() * 1e6) if position.time_utc is not None else wall_time_us()
    return GpsPosition(
        latitude=position.latitude_deg,
        longitude=position.longitude_deg,
        altitude=position.altitude_m,
        timestamp=utc_us,
        fix=position.fix,
        satellites=position.satellites,
        hdop=position.hdop,
        vdop=position.vdop,
        speed_mps=position.speed_mps,
        course_rad=position.course_rad,
        bad_lines=bad_lines,
    )


class GpsNmeaConfigurer(DataChannelConfigurer[GpsNmeaParams]):
    """Position, speed and fix of a GPS/GNSS receiver that speaks NMEA 0183."""

    connector_type = "gps-nmea"
    trial: ClassVar[dict[str, Any] | None] = {"source": "sample"}

    def configure(self) -> GpsNmea:
        return GpsNmea(self.label, self.params)
