"""The ``thermometer`` connector: a temperature that Linux shows as a file."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic
from typing import Any, ClassVar

from pydantic import Field

from mosaic_core import DataChannelConfigurer, DataChannelSendable, DeviceGone, Message, Params, unit

MADE_UP = Path("made-up")


class ThermometerParams(Params):
    path: Path = Field(
        default=Path("/sys/class/thermal/thermal_zone0/temp"),
        description="File with millidegrees Celsius; `made-up`: a thermometer to try it with.",
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
        with opened(self.params.path) as temperature_c:
            for _ in self.every(self.params.period_s):
                yield Temperature(temperature_c=temperature_c())


@contextmanager
def opened(path: Path) -> Iterator[Callable[[], float]]:
    """What reads the thermometer at ``path``. Raises :class:`DeviceGone` if there is none."""
    if path == MADE_UP:
        yield lambda: 20 + monotonic() % 5
        return
    try:
        file = path.open()
    except OSError as error:
        raise DeviceGone(f"{path}: {error.strerror}", "name a file of /sys/class/thermal") from error

    def temperature_c() -> float:
        file.seek(0)
        return int(file.read()) / 1000

    with file:
        yield temperature_c


class ThermometerConfigurer(DataChannelConfigurer[ThermometerParams]):
    """A temperature of this machine."""

    connector_type = "thermometer"
    trial: ClassVar[dict[str, Any] | None] = {"path": "made-up"}

    def configure(self) -> Thermometer:
        return Thermometer(self.label, self.params)
