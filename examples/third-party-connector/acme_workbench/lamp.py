"""The ``lamp`` connector: the brightness of an LED that Linux shows as a folder; dark when nobody commands it."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from mosaic_core import DataChannelConfigurer, DataChannelReceivable, Delivery, Message, Params, unit


class LampParams(Params):
    led: Path = Field(description="Folder of the LED: /sys/class/leds/NAME.", examples=["/sys/class/leds/NAME"])


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
        brightest = int((self.params.led / "max_brightness").read_text())
        self._shine(round(brightest * data.brightness_percent / 100))

    def make_safe(self, cause: str) -> None:
        """Runs on the robot's safety thread: after ``timeout_s`` of silence, and when the operator leaves."""
        self._shine(0)

    def _shine(self, brightness: int) -> None:
        (self.params.led / "brightness").write_text(str(brightness))


class LampConfigurer(DataChannelConfigurer[LampParams]):
    """The brightness of an LED of this machine."""

    connector_type = "lamp"

    def configure(self) -> Lamp:
        return Lamp(self.label, self.params)
