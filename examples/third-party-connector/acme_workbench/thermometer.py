"""The ``thermometer`` connector: a temperature that Linux shows as a file."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from pydantic import Field

from mosaic_core import DataChannelConfigurer, DataChannelSendable, Message, Params, unit


class ThermometerParams(Params):
    path: Path = Field(
        default=Path("/sys/class/thermal/thermal_zone0/temp"), description="File with millidegrees Celsius."
    )
    period_s: float = Field(default=1.0, gt=0, description="Seconds between two readings.")


class Temperature(Message):
    temperature_c: float = Field(json_schema_extra=unit("°C"))


class Thermometer(DataChannelSendable[Temperature]):
    widget = "acme-workbench/ThermometerPanel"
    """Of the module that this distribution ships, `widgets/acme-workbench.js`."""

    def __init__(self, label: str, params: ThermometerParams) -> None:
        super().__init__(label)
        self.params = params

    def messages(self) -> Iterator[Temperature]:
        with self.params.path.open() as file:
            for _ in self.every(self.params.period_s):
                file.seek(0)
                yield Temperature(temperature_c=int(file.read()) / 1000)


class ThermometerConfigurer(DataChannelConfigurer[ThermometerParams]):
    """A temperature of this machine."""

    connector_type = "thermometer"

    def configure(self) -> Thermometer:
        return Thermometer(self.label, self.params)
