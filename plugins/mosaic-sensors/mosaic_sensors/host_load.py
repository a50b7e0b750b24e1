"""The ``host-load`` connector: how busy, full and hot the robot's computer is."""

from __future__ import annotations

import time
from collections.abc import Iterator
from math import isfinite
from typing import ClassVar

import psutil
from pydantic import Field

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import DataChannelSendable
from mosaic_core.contract.params import Message, Params, unit
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.errors import DeviceGone

CPU_SENSORS = ("coretemp", "k10temp", "zenpower", "cpu_thermal", "cpu-thermal", "soc_thermal", "acpitz")
"""Names under which Linux shows the processor's temperature, the most precise first (Intel, AMD, ARM boards, ACPI)."""
FIRST_READING_S = 0.1
"""Processor load is a difference between two readings; this is the first one's distance."""


class HostLoadParams(Params):
    period_s: float = Field(default=1.0, ge=0.1, description="Seconds between two readings.")
    disk_path: str = Field(default="/", description="The disk to watch: any path on it.")
    temperature_sensor: str | None = Field(
        default=None, description="Name of the temperature sensor, as `sensors` shows it; default: the processor's."
    )


class HostLoadState(Message):
    cpu_percent: float = Field(json_schema_extra=unit("%"), description="All cores; 100 is all of them busy.")
    memory_percent: float = Field(json_schema_extra=unit("%"))
    disk_percent: float = Field(json_schema_extra=unit("%"))
    load_1_min: float = Field(
        description="Processes that run or wait, averaged over a minute.", json_schema_extra=unit("")
    )
    load_5_min: float = Field(json_schema_extra=unit(""))
    load_15_min: float = Field(json_schema_extra=unit(""))
    uptime_s: float = Field(json_schema_extra=unit("s"))
    temperature_c: float | None = Field(json_schema_extra=unit("°C"), description="null where no sensor is found.")


class HostLoad(DataChannelSendable[HostLoadState]):
    """Reads the operating system's own counters; needs no rights."""

    delivery: ClassVar[Delivery] = Delivery.LATEST
    widget: ClassVar[str | None] = "value-cards"

    def __init__(self, label: str, params: HostLoadParams) -> None:
        super().__init__(label)
        self.params = params

    def messages(self) -> Iterator[HostLoadState]:
        psutil.cpu_percent()
        self.pause(FIRST_READING_S)
        for _ in self.every(self.params.period_s):
            yield self._reading()

    def _reading(self) -> HostLoadState:
        load_1_min, load_5_min, load_15_min = psutil.getloadavg()
        return HostLoadState(
            cpu_percent=psutil.cpu_percent(),
            memory_percent=psutil.virtual_memory().percent,
            disk_percent=_disk_percent(self.params.disk_path),
            load_1_min=round(load_1_min, 2),
            load_5_min=round(load_5_min, 2),
            load_15_min=round(load_15_min, 2),
            uptime_s=round(_uptime_s(), 1),
            temperature_c=_temperature_c(self.params.temperature_sensor),
        )


def _uptime_s() -> float:
    """Without the wall clock where the system allows it: a robot's is often wrong until NTP has set it."""
    if hasattr(time, "CLOCK_BOOTTIME"):
        return time.clock_gettime(time.CLOCK_BOOTTIME)
    return time.time() - psutil.boot_time()


def _disk_percent(path: str) -> float:
    """Raises :class:`DeviceGone` for a disk that is not there, or no longer."""
    try:
        return psutil.disk_usage(path).percent
    except OSError as error:
        raise DeviceGone(f"{path}: {error.strerror or error}", "mount it, or mend `disk_path`") from error


def _temperature_c(wanted: str | None) -> float | None:
    """The hottest reading of the wanted or the processor's sensor; what is no temperature is left out. Raises
    :class:`DeviceGone` for a sensor that is not there, or no longer."""
    found = psutil.sensors_temperatures() if hasattr(psutil, "sensors_temperatures") else {}
    if wanted is not None and wanted not in found:
        raise DeviceGone(f"no temperature sensor '{wanted}'", f"found: {', '.join(sorted(found)) or 'none'}")
    for name in (wanted,) if wanted is not None else CPU_SENSORS:
        readings = [one.current for one in found.get(name, ()) if one.current is not None and isfinite(one.current)]
        if readings:
            return round(max(readings), 1)
    return None


class HostLoadConfigurer(DataChannelConfigurer[HostLoadParams]):
    """Load, memory, disk and temperature of the robot's computer."""

    connector_type = "host-load"

    def configure(self) -> HostLoad:
        return HostLoad(self.label, self.params)
