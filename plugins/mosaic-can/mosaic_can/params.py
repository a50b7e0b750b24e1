"""Models the params of a bus and of what is looked for on it. Every connector of one bus takes the same."""

from __future__ import annotations

from typing import Annotated, Self

from can.interfaces import VALID_INTERFACES
from pydantic import Field, field_validator, model_validator

from mosaic_core.contract.params import Params
from mosaic_core.words.errors import hint_at

FAKE = "fake"
"""The interface to a bus that is made up."""
MAX_ID = 0x1FFF_FFFF
MAX_STANDARD_ID = 0x7FF


class CanBusParams(Params):
    """One bus, as python-can opens it."""

    interface: str = Field(
        default="socketcan",
        description="`socketcan` on Linux; else the name that python-can has for the adapter, such as `slcan`, `pcan` "
        "or `gs_usb`; `fake`: a bus that is made up.",
    )
    channel: str = Field(default="can0", min_length=1, description="can0, a serial port, or what the adapter calls it.")
    bitrate: int | None = Field(
        default=None, ge=1000, le=1_000_000, description="Bits per second; SocketCAN's is set by `ip link` instead."
    )
    fd: bool = Field(default=False, description="CAN FD: up to 64 bytes a frame.")
    options: dict[str, bool | int | float | str] = Field(
        default={}, max_length=32, description="Further words that python-can's interface takes."
    )
    dbc: tuple[str, ...] = Field(
        default=(),
        max_length=16,
        description="Files that tell what frames mean: DBC, or KCD, SYM and ARXML; `sample`: one to try it with.",
    )

    @field_validator("dbc", mode="before")
    @classmethod
    def _one_is_enough(cls, files: object) -> object:
        return (files,) if isinstance(files, str) else files

    @field_validator("interface")
    @classmethod
    def _is_one(cls, name: str) -> str:
        known = {FAKE, *VALID_INTERFACES}
        if name not in known:
            raise ValueError(f"python-can has no interface {name!r}{hint_at(name, known)}")
        return name

    @property
    def name(self) -> str:
        """The bus in messages."""
        return f"{self.interface} {self.channel}"


CanId = Annotated[int, Field(ge=0, le=MAX_ID)]


class CanFilter(Params):
    """What frames are taken: those whose id is ``id`` in the bits of ``mask``."""

    id: CanId = Field(description="0x201, for example: YAML reads it as it is.")
    mask: CanId | None = Field(default=None, description="Bits of the id that count; default: all of them.")
    extended: bool = Field(default=False, description="Ids of 29 bits instead of 11.")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if not self.extended and max(self.id, self.mask or 0) > MAX_STANDARD_ID:
            raise ValueError(f"{max(self.id, self.mask or 0):#x} has more than 11 bits; write `extended: true`")
        return self

    def takes(self, frame_id: int, *, is_extended: bool) -> bool:
        mask = MAX_ID if self.mask is None else self.mask
        return is_extended == self.extended and (frame_id ^ self.id) & mask == 0
