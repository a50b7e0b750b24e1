"""The ``drift`` connector answers when it is asked: how much a temperature moves while one waits."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

from pydantic import Field

from acme_workbench.thermometer import ThermometerParams, opened
from mosaic_core import DataChannelConfigurer, DeviceGone, Message, Params, Refused, Request, RequestHandler, unit


class DriftParams(Params):
    path: Path = Field(
        default=ThermometerParams().path,
        description="File with millidegrees Celsius; `made-up`: a thermometer to try it with.",
    )


class Watch(Message):
    seconds: float = Field(gt=0, le=60, json_schema_extra=unit("s"))


class Drift(Message):
    lowest_c: float = Field(json_schema_extra=unit("°C"))
    highest_c: float = Field(json_schema_extra=unit("°C"))


class DriftWatcher(RequestHandler[Watch, Drift]):
    answer_within_s = 65.0

    def __init__(self, label: str, params: DriftParams) -> None:
        super().__init__(label)
        self.params = params

    def answer(self, question: Watch, request: Request) -> Drift:
        """On a thread of its own for each request, so it may wait; whoever asked may take the request back."""
        try:
            with opened(self.params.path) as temperature_c:
                readings = [temperature_c()]
                for tenth in range(1, 11):
                    if request.pause(question.seconds / 10):
                        break
                    readings.append(temperature_c())
                    request.progress({"percent": tenth * 10, "now_c": readings[-1]})
        except (DeviceGone, OSError) as error:
            raise Refused("workbench.no_thermometer", "the thermometer is not there now") from error
        return Drift(lowest_c=min(readings), highest_c=max(readings))


class DriftConfigurer(DataChannelConfigurer[DriftParams]):
    """Answers how much a temperature of this machine moves in some seconds."""

    connector_type = "drift"
    trial: ClassVar[dict[str, Any] | None] = {"path": "made-up"}

    def configure(self) -> DriftWatcher:
        return DriftWatcher(self.label, self.params)
