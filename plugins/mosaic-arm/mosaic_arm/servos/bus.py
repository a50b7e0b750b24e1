"""What the arm needs of a bus of servos, whatever its protocol. One thread, the arm's own, uses a bus."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, Self

from mosaic_arm.calibration import MotorCalibration


@dataclass(frozen=True, slots=True)
class MotorReading:
    """What a motor says of itself. ``faults``: words for what its own protection has found, such as ``overload``."""

    ticks: int
    ticks_per_s: float = 0.0
    load_percent: float = 0.0
    voltage_v: float = 0.0
    temperature_c: float = 0.0
    faults: tuple[str, ...] = ()


class ServoBus(Protocol):
    """An open bus. Whatever fails raises :class:`~mosaic_core.DeviceGone`."""

    def __enter__(self) -> Self: ...
    def __exit__(self, *_: object) -> None: ...

    def missing(self) -> list[int]:
        """The motors that do not answer."""

    def read(self) -> dict[int, MotorReading]:
        """One reading of each motor that answered; a reply that was lost or broken is left out."""

    def write_goals(self, ticks: Mapping[int, int]) -> None:
        """Goals of several motors in one packet."""

    def set_torque(self, motors: Sequence[int], *, on: bool) -> None:
        """Power them, or let them go."""

    def limit_torque(self, percent: Mapping[int, float]) -> None:
        """How strong each may be at most; forgotten when its power goes."""

    def homing_offsets(self) -> dict[int, int]:
        """What is kept in the motors."""

    def store_calibration(self, joints: Sequence[MotorCalibration]) -> None:
        """Keep offset and range in the motors. Their torque must be off."""
