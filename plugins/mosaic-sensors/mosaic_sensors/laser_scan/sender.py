"""The base of laser scan connectors: compact toward operators of ours, the JSON that they know toward original ones."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import ClassVar, Literal, TypeAlias

from pydantic import Field

from mosaic_core.contract.handler import DataChannelSendable
from mosaic_core.contract.params import Params
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.delivery import DeliveryContract
from mosaic_sensors.laser_scan.compact_form import encoded_scan
from mosaic_sensors.laser_scan.scan import Scan, json_of

Form: TypeAlias = Literal["compact", "json"]


class LaserScanParams(Params):
    """How scans are sent; derive the params of a connector that sends some from it."""

    form: Form = Field(
        default="compact",
        description="compact: a sixth of the bytes, for the dashboard and Python; json: for programs of your own. "
        "Original dashboards always get JSON.",
    )


class LaserScanSender(DataChannelSendable[bytes]):
    """Derive from it and write :meth:`scans`, or push with :meth:`send_scan` from any thread::

    class Lidar(LaserScanSender):
        def scans(self):
            with opened_lidar() as lidar:
                while not self.is_stopping:
                    yield scan_of(lidar.ranges(), -math.pi, math.tau / 1080, intensities=lidar.intensities())
    """

    runs = "watched"
    widget: ClassVar[str | None] = "laser-scan"
    delivery: ClassVar[Delivery | DeliveryContract] = Delivery.LATEST

    def __init__(self, label: str, params: LaserScanParams | None = None) -> None:
        super().__init__(label)
        self._form: Form = (params or LaserScanParams()).form

    def scans(self) -> Iterable[Scan]:
        """Yield scans. Runs on a thread of its own, only while somebody watches."""
        return ()

    def messages(self) -> Iterable[bytes]:
        """Sends the scans of :meth:`scans`."""
        for scan in self.scans():
            self.send_scan(scan)
        return ()

    def send_scan(self, scan: Scan) -> bool:
        """Send one scan now; ``False``: nobody watches. Any thread."""
        if not self.is_heard:
            return False
        if self._form == "json":
            return self.send_string(json_of(scan))
        return self.send_bytes(encoded_scan(scan), original_text=cache(lambda: json_of(scan)))
