"""A bus of real packets on a pseudo terminal, against motors that check every byte and sometimes do not answer."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from support.devices.servo_chain import DynamixelChain, ServoChain

from mosaic_arm.calibration import MotorCalibration
from mosaic_arm.params import ArmParams, JointParams
from mosaic_arm.servos.bus import ServoBus
from mosaic_arm.servos.opening import bus_of
from mosaic_core import DeviceGone

MOTORS = [1, 2, 3, 4, 5, 6]
JOINTS = [MotorCalibration(id=motor, homing_offset=-10 * motor, range_min=500, range_max=3500) for motor in MOTORS]


@pytest.fixture(params=["feetech", "dynamixel"])
def chain(request: pytest.FixtureRequest) -> Iterator[ServoChain]:
    kind = ServoChain if request.param == "feetech" else DynamixelChain
    with kind(MOTORS) as chain:
        for motor, servo in chain.motors.items():
            servo.put(chain.present[0], 2000 + motor, 2)
        yield chain
        assert chain.complaints == []


def bus_to(chain: ServoChain, motors: list[MotorCalibration] = JOINTS) -> ServoBus:
    kind = "dynamixel" if isinstance(chain, DynamixelChain) else "feetech"
    joints = {f"joint {one.id}": JointParams(id=one.id) for one in motors}
    return bus_of(ArmParams(bus=kind, port=chain.port, joints=joints, gripper=None), motors)


def ticks(bus: ServoBus) -> dict[int, int]:
    return {motor: one.ticks for motor, one in bus.read().items()}


def test_all_motors_are_read_at_once_and_written_at_once(chain: ServoChain) -> None:
    with bus_to(chain) as bus:
        assert bus.missing() == []
        before = len(chain.instructions)
        assert ticks(bus) == {motor: 2000 + motor for motor in MOTORS}
        bus.write_goals({motor: 1000 + motor for motor in MOTORS})
        assert ticks(bus) == {motor: 1000 + motor for motor in MOTORS}
        assert [code for _, code, _ in chain.instructions[before:]] == [0x82, 0x83, 0x82]


@pytest.mark.usefixtures("soon_silent")
def test_a_reply_that_is_dropped_leaves_out_its_motor_alone(chain: ServoChain) -> None:
    with bus_to(chain) as bus:
        chain.drops[3] = 1
        assert set(ticks(bus)) == {1, 2, 4, 5, 6}
        assert set(ticks(bus)) == set(MOTORS)


@pytest.mark.usefixtures("soon_silent")
def test_a_wrong_checksum_is_no_reading(chain: ServoChain) -> None:
    with bus_to(chain) as bus:
        chain.breaks[2] = 1
        assert set(ticks(bus)) == {1, 3, 4, 5, 6}


def test_noise_between_replies_costs_nothing(chain: ServoChain) -> None:
    chain.noise = b"\x00\x13\xff\x42"
    with bus_to(chain) as bus:
        assert set(ticks(bus)) == set(MOTORS)


@pytest.mark.usefixtures("soon_silent")
def test_motors_that_are_not_there_are_named(chain: ServoChain) -> None:
    del chain.motors[2], chain.motors[5]
    with bus_to(chain) as bus:
        assert bus.missing() == [2, 5]


@pytest.mark.usefixtures("soon_silent")
def test_a_first_ping_may_be_lost(chain: ServoChain) -> None:
    chain.drops[4] = 1
    with bus_to(chain) as bus:
        assert bus.missing() == []


def test_an_adapter_that_is_unplugged_is_a_device_that_is_gone(chain: ServoChain) -> None:
    with bus_to(chain) as bus:
        chain.vanish()
        with pytest.raises(DeviceGone, match="is lost"):
            bus.read()
    with pytest.raises(DeviceGone, match="can't be opened"):
        bus_to(chain).__enter__()


def test_two_programs_can_not_share_a_port(chain: ServoChain) -> None:
    with bus_to(chain), pytest.raises(DeviceGone, match="can't be opened"):
        bus_to(chain).__enter__()


def test_a_calibration_is_kept_in_the_motors(chain: ServoChain) -> None:
    with bus_to(chain) as bus:
        bus.store_calibration(JOINTS)
        assert bus.homing_offsets() == {motor: -10 * motor for motor in MOTORS}


@pytest.mark.usefixtures("soon_silent")
def test_a_motor_that_does_not_take_its_calibration_is_told(chain: ServoChain) -> None:
    with bus_to(chain) as bus:
        chain.drops[1] = 9
        with pytest.raises(DeviceGone, match=r"motor 1 .* did not take"):
            bus.store_calibration(JOINTS)


def test_what_a_feetech_says_of_itself() -> None:
    with ServoChain([1]) as chain:
        servo = chain.motors[1]
        servo.registers[56:64] = bytes.fromhex("e8 03 2c 81 64 04 4a 37")
        servo.error = 0x24
        with bus_to(chain, JOINTS[:1]) as bus:
            one = bus.read()[1]
    assert (one.ticks, one.ticks_per_s, one.load_percent) == (1000, -300, -10.0)
    assert (one.voltage_v, one.temperature_c, one.faults) == (7.4, 55, ("overheating", "overload"))


def test_a_dynamixel_with_an_alert_is_asked_what_it_is() -> None:
    with DynamixelChain([1]) as chain:
        servo = chain.motors[1]
        servo.put(126, -125, 2)
        servo.put(128, -100, 4)
        servo.put(132, -4096, 4)
        servo.put(144, 120, 2)
        servo.put(146, 71, 1)
        servo.put(70, 0x20, 1)
        servo.error = 0x80
        with bus_to(chain, JOINTS[:1]) as bus:
            one = bus.read()[1]
    assert (one.ticks, one.load_percent, one.voltage_v) == (-4096, -12.5, 12.0)
    assert one.ticks_per_s == pytest.approx(-100 * 15.633, rel=1e-3)
    assert (one.temperature_c, one.faults) == (71, ("overload",))


def test_torque_is_limited_as_a_share_of_all(chain: ServoChain) -> None:
    address, full = (100, 885) if isinstance(chain, DynamixelChain) else (48, 1000)
    with bus_to(chain) as bus:
        bus.limit_torque({1: 50.0, 2: 100.0})
        bus.set_torque([1], on=True)
        bus.read()  # whoever answers has read what came before
    assert [chain.motors[motor].get(address, 2) for motor in (1, 2)] == [round(full / 2), full]
