"""The ``lidar-ld19`` and ``lidar-rplidar`` connectors: laser scans of a scanner on a serial line."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, ClassVar

from pydantic import Field, model_validator

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.machines.timing.pacing import ComplaintPace
from mosaic_core.words.errors import DeviceGone
from mosaic_sensors.byte_source import ByteSource, FakeSource, LiveSource, is_serial, opened
from mosaic_sensors.laser_scan import LaserScanParams, LaserScanSender, Scan
from mosaic_sensors.lidars import ld19, rplidar
from mosaic_sensors.lidars.fake_room import ld19_pieces, rplidar_pieces
from mosaic_sensors.lidars.ld19 import Ld19Parser
from mosaic_sensors.lidars.rplidar import RplidarParser
from mosaic_sensors.lidars.turns import Mounting, TurnParser

_log = logging.getLogger(__name__)

SPIN_UP_S = 0.5
"""A motor that has just begun makes turns of any length; it also needs 1 ms after STOP."""


class LidarParams(LaserScanParams):
    """What all scanners on a serial line have in common."""

    source: LiveSource = Field(
        default="/dev/ttyUSB0",
        description="/dev/tty… or COM3: a serial port; tcp://host:port: one that another computer passes on; "
        "`fake`: a scanner that is made up, to try it.",
    )
    baud: int = Field(default=ld19.BAUD, gt=0, description="Speed of the serial port.")
    frame_id: str = Field(default="", max_length=64, description="The coordinate frame of the scanner.")
    rays: int = Field(default=ld19.RAYS, ge=8, le=7200, description="Of a scan; each is the nearest of its points.")
    yaw_rad: float = Field(default=0.0, description="Where its front looks: counter-clockwise from the robot's.")
    upside_down: bool = Field(default=False, description="It hangs with its feet up.")
    range_min_m: float = Field(default=0.05, ge=0, description="What is nearer is no return: the robot itself.")
    range_max_m: float = Field(default=12.0, gt=0, description="What is farther is no return.")
    silence_s: float = Field(default=5.0, gt=0, description="Open it again when no turn was completed for so long.")

    @model_validator(mode="after")
    def _range_is_one(self) -> LidarParams:
        if self.range_min_m >= self.range_max_m:
            raise ValueError("range_min_m must be less than range_max_m")
        return self


class RplidarParams(LidarParams):
    baud: int = Field(default=rplidar.BAUD, gt=0, description="115200: A1, A2M8; 256000: A2M7, A2M12, A3.")
    rays: int = Field(default=rplidar.RAYS, ge=8, le=7200, description="Of a scan; each is the nearest of its points.")
    range_min_m: float = Field(default=0.15, ge=0, description="What is nearer is no return: the robot itself.")


class LidarSender(LaserScanSender):
    """Sends a scan per turn. What makes no sense is counted as refused. Closed while nobody watches."""

    def __init__(self, label: str, params: LidarParams) -> None:
        super().__init__(label, params)
        self.params = params
        self._complaints = ComplaintPace()

    def parser(self) -> TurnParser:
        """A new one for each time that it is opened."""
        raise NotImplementedError

    def fake_pieces(self) -> Iterator[tuple[float, bytes]]:
        """What a scanner says that is made up."""
        raise NotImplementedError

    @contextmanager
    def turning(self, source: ByteSource) -> Iterator[None]:
        """It measures in this block; of those that do so by themselves nothing is asked."""
        yield

    def scans(self) -> Iterator[Scan]:
        try:
            with opened(self.params.source, self.params.baud, self._fake) as source, self.turning(source):
                yield from self._turns(source)
        except OSError as error:
            raise DeviceGone(f"{self.params.source}: {error}") from error

    def _fake(self) -> FakeSource:
        return FakeSource(self.fake_pieces(), self.pause)

    def _turns(self, source: ByteSource) -> Iterator[Scan]:
        params, parser, bad_packets = self.params, self.parser(), 0
        mounting = Mounting(params.rays, params.yaw_rad, params.upside_down, params.range_min_m, params.range_max_m)
        turned_at_s = self.monotonic_s()
        while not self.is_stopping:
            turns = parser.feed(source.read())
            now_s = self.monotonic_s()
            self._count(parser.bad_packets - bad_packets, now_s)
            bad_packets = parser.bad_packets
            if turns:
                self.count_loss("thinned", len(turns) - 1)
                yield mounting.scan(turns[-1], params.frame_id, now_s, now_s - turned_at_s)
                turned_at_s = now_s
            elif now_s - turned_at_s > params.silence_s:
                raise TimeoutError(f"no turn for {params.silence_s:g} s; does it turn{self._hint}?")

    def _count(self, bad_packets: int, now_s: float) -> None:
        if bad_packets:
            self.count_loss("refused", bad_packets)
            if self._complaints.is_due("refused", now_s):
                _log.warning("%s: %s says what makes no sense; left out", self.label, self.params.source)

    @property
    def _hint(self) -> str:
        return f", and is {self.params.baud} its baud rate" if is_serial(self.params.source) else ""


class Ld19(LidarSender):
    """Sends the scans of an LD19, LD06 or STL-19P, which measures as long as it has power."""

    def parser(self) -> TurnParser:
        return Ld19Parser()

    def fake_pieces(self) -> Iterator[tuple[float, bytes]]:
        return ld19_pieces()


class Rplidar(LidarSender):
    """Sends the scans of an RPLIDAR, which turns only while somebody watches."""

    def parser(self) -> TurnParser:
        return RplidarParser()

    def fake_pieces(self) -> Iterator[tuple[float, bytes]]:
        return rplidar_pieces()

    @contextmanager
    def turning(self, source: ByteSource) -> Iterator[None]:
        source.set_dtr(False)  # an A1's motor turns while DTR is off
        source.write(rplidar.STOP + rplidar.motor_command(rplidar.MOTOR_PWM))
        self.pause(SPIN_UP_S)
        source.write(rplidar.SCAN)
        try:
            yield
        finally:
            with suppress(OSError):  # one that is gone takes nothing
                source.write(rplidar.STOP + rplidar.motor_command(0))
                source.set_dtr(True)


class Ld19Configurer(DataChannelConfigurer[LidarParams]):
    """Laser scans of an LDROBOT LD19, LD06 or STL-19P."""

    connector_type = "lidar-ld19"
    trial: ClassVar[dict[str, Any] | None] = {"source": "fake"}

    def configure(self) -> Ld19:
        return Ld19(self.label, self.params)


class RplidarConfigurer(DataChannelConfigurer[RplidarParams]):
    """Laser scans of a Slamtec RPLIDAR A1, A2 or A3."""

    connector_type = "lidar-rplidar"
    trial: ClassVar[dict[str, Any] | None] = {"source": "fake"}

    def configure(self) -> Rplidar:
        return Rplidar(self.label, self.params)
