"""Reads and writes calibration files: JSON as LeRobot writes it, one object per joint.

::

    {"shoulder_pan": {"id": 1, "drive_mode": 0, "homing_offset": -1503, "range_min": 749, "range_max": 3465}, …}

A joint's zero is the middle of its range. ``drive_mode`` 1 turns its direction around. ``homing_offset`` is kept in the
motor itself: the ticks of the range are those that it tells with this offset.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Self

from pydantic import BaseModel, ConfigDict, Field, RootModel, ValidationError, model_validator

from mosaic_core.words.errors import MosaicError, nearest
from mosaic_core.words.wire_model import told_mistakes

TICKS_PER_TURN = 4096
"""Of Feetech's STS and SMS and of Dynamixel's X series alike: 12 bits a turn."""
MAX_FILE_BYTES = 64 * 1024


class MotorCalibration(BaseModel):
    """How one motor sits in the arm, in ticks."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    id: int = Field(ge=0, le=252)
    drive_mode: int = Field(default=0, ge=0, le=1)
    homing_offset: int = Field(default=0, ge=-TICKS_PER_TURN, le=TICKS_PER_TURN)
    range_min: int = Field(ge=-TICKS_PER_TURN, le=2 * TICKS_PER_TURN)
    range_max: int = Field(ge=-TICKS_PER_TURN, le=2 * TICKS_PER_TURN)

    @model_validator(mode="after")
    def _is_a_range(self) -> Self:
        if not 0 < self.range_max - self.range_min < TICKS_PER_TURN:
            raise ValueError(
                f"range_min {self.range_min} and range_max {self.range_max} are no range within one turn "
                f"({TICKS_PER_TURN} ticks)"
            )
        return self


def check_motors(ids: Iterable[int]) -> None:
    """Raises :class:`ValueError` where two joints have the same motor."""
    twice = [motor for motor, joints in sorted(Counter(ids).items()) if joints > 1]
    if twice:
        raise ValueError(f"two joints have the motor {twice[0]}")


class ArmCalibration(RootModel[dict[str, MotorCalibration]]):
    """All joints of one arm by their names."""

    @model_validator(mode="after")
    def _ids_are_unique(self) -> Self:
        check_motors(one.id for one in self.root.values())
        return self


def read_calibration(path: Path, ids: Mapping[str, int]) -> dict[str, MotorCalibration]:
    """The calibration of the joints ``ids`` (name → motor). Raises :class:`MosaicError` (``config.invalid``) that names
    the file, what is wrong in it, and the cure."""
    cure = f"Calibrate again: mosaic arm calibrate {path}"
    try:
        text = path.read_bytes()
        if len(text) > MAX_FILE_BYTES:
            raise ValueError(f"it is larger than {MAX_FILE_BYTES} bytes")
        found = ArmCalibration.model_validate_json(text).root
    except OSError as error:
        raise _wrong(path, f"it can't be read: {error.strerror}", cure) from None
    except ValidationError as error:
        raise _wrong(path, told_mistakes(error, 1), cure) from None
    except ValueError as error:
        raise _wrong(path, str(error), cure) from None
    for name, motor in ids.items():
        if name not in found:
            meant = nearest(name, found)
            cure = f"Write '{meant}' alike in both, or calibrate again: mosaic arm calibrate {path}" if meant else cure
            raise _wrong(path, f"the joint '{name}' is missing; it has {', '.join(found) or 'none'}", cure)
        if found[name].id != motor:
            raise _wrong(path, f"'{name}' is motor {found[name].id} there and {motor} in the params", cure)
    return {name: found[name] for name in ids}


def write_calibration(path: Path, joints: Mapping[str, MotorCalibration]) -> None:
    """Write the file; whoever reads it meanwhile sees the old one or the new one, whole."""
    beside = path.with_name(f"{path.name}.new")
    text = json.dumps({name: one.model_dump() for name, one in joints.items()}, indent=4)
    beside.write_text(text + "\n", "utf-8")
    beside.replace(path)


def _wrong(path: Path, what: str, cure: str) -> MosaicError:
    return MosaicError(f"calibration {path}: {what}. {cure}", code="config.invalid", cure=cure)
