"""Models the params of connectors on serial lines."""

from __future__ import annotations

from pydantic import Field

from mosaic_core.contract.params import Params
from mosaic_sensors.byte_source import LiveSource


class LineParams(Params):
    """What all devices on a serial line have in common."""

    source: LiveSource = Field(
        default="/dev/ttyUSB0",
        description="/dev/tty… or COM3: a serial port; tcp://host:port: one that another computer passes on; "
        "`fake`: a device that is made up, to try it.",
    )
    baud: int = Field(default=115_200, gt=0, description="Speed of the serial port.")
    silence_s: float | None = Field(
        default=None, gt=0, description="Open it again when no line came for so long; default: it may be silent."
    )
    max_line_bytes: int = Field(default=4096, ge=16, le=65_536, description="Longer lines are refused.")
    max_rate_hz: float = Field(default=100.0, gt=0, le=1000, description="What comes faster is left out, and counted.")
