"""The one arm of a robot behind all connectors that name its port."""

from __future__ import annotations

import time
from collections.abc import Callable

from mosaic_arm.arm import Arm
from mosaic_arm.arm_joint import joints_of
from mosaic_arm.bus_session import BusSession
from mosaic_arm.params import ArmParams
from mosaic_arm.pose_file import PoseBook
from mosaic_arm.servos.bus import ServoBus
from mosaic_arm.servos.opening import bus_of
from mosaic_core import Shared


class KeptArm(Arm):
    """An arm with the params that it was made of."""

    def __init__(
        self, params: ArmParams, bus: ServoBus | None = None, clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Opens nothing. ``bus``: another one than the params name. Raises :class:`MosaicError` for a calibration that
        can't be used."""
        calibrations = params.calibrations()
        joints = joints_of(params, calibrations)
        offsets = {one.id: one.homing_offset for one in calibrations.values()} if params.calibration else None
        bus = bus or bus_of(params, list(calibrations.values()))
        super().__init__(
            joints, BusSession(bus, params, joints, offsets), params.rate_hz, clock,
            is_free=params.starts_free, gripper=params.gripper,
        )  # fmt: skip
        self.params = params
        self.pose_books: dict[str, PoseBook] = {}
        """Of its connectors that go to poses, by label; complete before anything runs."""


def shared_key(params: ArmParams) -> str:
    """Under which the arm is shared."""
    return f"mosaic-arm:{params.bus}:{params.port}"


def shared_arm(params: ArmParams, shared: Shared) -> KeptArm:
    """The arm at ``params.port``, the same for all who ask. Raises :class:`MosaicError` (``config.invalid``) where two
    connectors describe it differently."""
    return shared.agreed(shared_key(params), lambda: KeptArm(params), params, f"the arm at {params.port}")
