"""Models the params of a line and of the fields that lie in a device's registers."""

from __future__ import annotations

from typing import Literal, Self
from urllib.parse import urlsplit

from pydantic import Field, field_validator, model_validator

from mosaic_core.contract.params import Params, unit
from mosaic_core.words.limits import MotionKind

FAKE = "fake"
"""The line to a device that is made up."""
TCP, RTU_OVER_TCP = "tcp", "rtu+tcp"
DEFAULT_PORT = 502
Parity = Literal["none", "even", "odd"]
ReadKind = Literal["holding", "input", "coil", "discrete"]
WriteKind = Literal["holding", "coil"]
NumberType = Literal["int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64", "boolean"]
Order = Literal["big", "little"]
MAX_FIELDS = 256


class ModbusLineParams(Params):
    """What leads to one or several devices."""

    source: str = Field(
        default="/dev/ttyUSB0",
        description="/dev/tty… or COM3: RTU on a serial port; tcp://host:port: Modbus TCP; rtu+tcp://host:port: RTU "
        "frames through a converter; `fake`: a device that is made up.",
    )
    baud: int = Field(default=19_200, ge=300, le=1_000_000, description="Speed of the serial port.")
    parity: Parity = Field(default="even", description="Of the serial port; `even` where the device says nothing else.")
    stop_bits: Literal[1, 2] = Field(default=1, description="Of the serial port; 2 is usual without parity.")
    timeout_s: float = Field(
        default=0.5, gt=0, le=2, description="Wait so long for an answer; a stop may have to wait for one, too."
    )

    @field_validator("source")
    @classmethod
    def _can_be_opened(cls, source: str) -> str:
        if source == FAKE or source.startswith("/dev/") or source.upper().startswith("COM"):
            return source
        url = urlsplit(source)
        if url.scheme not in (TCP, RTU_OVER_TCP) or not url.hostname or url.path:
            raise ValueError(f"{source!r} is no line; write /dev/ttyUSB0, tcp://host:port or {FAKE}")
        if url.port == 0:  # reading it also refuses what is no port
            raise ValueError("port 0 is none")
        return source


class RegisterField(Params):
    """A number in a device's registers."""

    address: int = Field(ge=0, le=65_535, description="As in the protocol, from 0: 40001 of a manual is holding 0.")
    kind: ReadKind = Field(default="holding", description="Which of the device's four tables it lies in.")
    type: NumberType | None = Field(default=None, description="Default: uint16, of coils and discrete inputs boolean.")
    bit: int | None = Field(default=None, ge=0, le=15, description="One bit of a register, 0 is the lowest: a boolean.")
    byte_order: Order = Field(default="big", description="Within a register.")
    word_order: Order = Field(default="big", description="Of several registers: `big` has the high one first.")
    scale: float = Field(default=1.0, description="What 1 in the register means.", json_schema_extra=unit(""))
    offset: float = Field(default=0.0, description="What 0 in the register means.", json_schema_extra=unit(""))
    unit: str | None = Field(default=None, max_length=16, description="As operators see it; default: by its name.")
    description: str = Field(default="", max_length=200, description="What it means.")

    @property
    def number_type(self) -> NumberType:
        """Its type, said or not."""
        if self.type is not None:
            return self.type
        return "boolean" if self.kind in ("coil", "discrete") or self.bit is not None else "uint16"

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        is_single = self.kind in ("coil", "discrete")
        if is_single and (self.number_type != "boolean" or self.bit is not None):
            raise ValueError(f"a {self.kind} is one bit; leave `type` and `bit` out")
        if not is_single and (self.number_type == "boolean") != (self.bit is not None):
            raise ValueError("a boolean in a register needs its `bit`, and a bit is a boolean")
        if self.number_type == "boolean" and (self.scale, self.offset) != (1.0, 0.0):
            raise ValueError("a boolean has no scale and no offset")
        if self.scale == 0:
            raise ValueError("scale: 0 would make all values the same")
        return self


class WriteField(RegisterField):
    """A number that operators write into a device's registers."""

    kind: WriteKind = Field(default="holding", description="Holding register or coil: what can be written.")
    motion: MotionKind | None = Field(
        default=None, description="velocity: it moves something and 0 stands still; position: it is a place to go to."
    )
    min: float | None = Field(default=None, description="Least value, in its unit.", json_schema_extra=unit(""))
    max: float | None = Field(default=None, description="Greatest value, in its unit.", json_schema_extra=unit(""))
    safe: float | bool | None = Field(
        default=None,
        description="What is written on silence, when the operator is lost, and on a stop; of a velocity 0.",
        json_schema_extra=unit(""),
    )

    @model_validator(mode="after")
    def _can_be_written(self) -> Self:
        if self.bit is not None:
            raise ValueError("a single bit of a register can't be written; write the register")
        if self.number_type == "boolean" and (self.motion, self.min, self.max) != (None, None, None):
            raise ValueError("a coil has no motion, no min and no max")
        if self.motion == "position" and self.safe is None:
            raise ValueError("a position needs `safe`: where shall it go when nobody commands?")
        return self
