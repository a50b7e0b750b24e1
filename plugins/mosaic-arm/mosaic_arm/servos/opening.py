"""Makes the bus that params name."""

from __future__ import annotations

from collections.abc import Sequence

from mosaic_arm.calibration import MotorCalibration
from mosaic_arm.params import ArmParams
from mosaic_arm.servos.bus import ServoBus
from mosaic_arm.servos.dynamixel import DYNAMIXEL, DynamixelFormat
from mosaic_arm.servos.feetech import FEETECH, FeetechFormat
from mosaic_arm.servos.serial_bus import SerialBus
from mosaic_arm.servos.serial_line import SerialLine
from mosaic_arm.servos.simulated_bus import SimulatedBus


def bus_of(params: ArmParams, joints: Sequence[MotorCalibration]) -> ServoBus:
    """The bus of an arm with these joints, not open yet."""
    motors = [one.id for one in joints]
    if params.bus == "fake":
        return SimulatedBus(joints)
    if params.bus == "feetech":
        return SerialBus(SerialLine(FeetechFormat(), params.port, params.baud), FEETECH, motors)
    return SerialBus(SerialLine(DynamixelFormat(), params.port, params.baud), DYNAMIXEL, motors)
