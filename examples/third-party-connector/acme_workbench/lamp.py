"""The ``lamp`` connector: the brightness of an LED that Linux shows as a folder; dark when nobody commands it."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

from pydantic import Field

from mosaic_core import DataChannelConfigurer, DataChannelReceivable, Delivery, DeviceGone, Message, Params, unit

MADE_UP = Path("made-up")


class LampParams(Params):
    led: Path = Field(
        description="Folder of the LED: /sys/class/leds/NAME. `made-up`: a lamp that is not there.",
        examples=["/sys/class/leds/NAME"],
    )


class Brightness(Message):
    brightness_percent: float = Field(ge=0, le=100, json_schema_extra=unit("%"))


class Lamp(DataChannelReceivable[Brightness]):
    delivery = Delivery.LATEST
    timeout_s = 5.0
    motion_fields = ()
    """Light moves nothing: a bad link doesn't dim it."""

    def __init__(self, label: str, params: LampParams) -> None:
        super().__init__(label)
        self.params = params

    def handle_data(self, data: Brightness) -> None:
        self._shine(data.brightness_percent)

    def make_safe(self, cause: str) -> None:
        """Runs on the robot's safety thread: after ``timeout_s`` of silence, and when the operator leaves."""
        self._shine(0)

    def _shine(self, percent: float) -> None:
        led = self.params.led
        if led == MADE_UP:
            return
        try:
            brightest = int((led / "max_brightness").read_text())
            (led / "brightness").write_text(str(round(brightest * percent / 100)))
        except OSError as error:
            raise DeviceGone(f"{led}: {error.strerror}", "name a folder of /sys/class/leds") from error


class LampConfigurer(DataChannelConfigurer[LampParams]):
    """The brightness of an LED of this machine."""

    connector_type = "lamp"
    trial: ClassVar[dict[str, Any] | None] = {"led": "made-up"}

    def configure(self) -> Lamp:
        return Lamp(self.label, self.params)
