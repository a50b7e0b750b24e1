"""Packets of both protocols: spelt as their makers' manuals do, and found in any stream of bytes."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.devices.servo_chain import DynamixelChain, ServoChain, bitwise_crc

from mosaic_arm.servos.dynamixel import DYNAMIXEL, DynamixelFormat, crc16, faults_of
from mosaic_arm.servos.feetech import FEETECH, FeetechFormat, from_sign_bit, to_sign_bit
from mosaic_arm.servos.packets import PING, PacketFormat, ServoReply, read_block, read_one, write_block

FORMATS: dict[str, tuple[PacketFormat, type[ServoChain]]] = {
    "feetech": (FeetechFormat(), ServoChain),
    "dynamixel": (DynamixelFormat(), DynamixelChain),
}
both = pytest.mark.parametrize(("form", "chain"), FORMATS.values(), ids=FORMATS)


def test_feetech_pings_as_its_manual_does() -> None:
    assert FeetechFormat().instruction(1, PING).hex(" ") == "ff ff 01 02 01 fb"


def test_feetech_reads_the_position_as_its_manual_does() -> None:
    assert read_one(FeetechFormat(), 1, 0x38, 2).hex(" ") == "ff ff 01 04 02 38 02 be"


def test_dynamixel_pings_as_its_manual_does() -> None:
    assert DynamixelFormat().instruction(1, PING).hex(" ") == "ff ff fd 00 01 03 00 01 19 4e"


def test_dynamixel_reads_several_positions_as_its_manual_does() -> None:
    packet = read_block(DynamixelFormat(), [1, 2], 132, 4)
    assert packet.hex(" ") == "ff ff fd 00 fe 09 00 82 84 00 04 00 01 02 ce fa"


@given(st.binary(max_size=60))
def test_the_table_divides_as_the_polynomial_does(data: bytes) -> None:
    assert crc16(data) == bitwise_crc(data)


@both
@given(st.binary(max_size=60), st.integers(0, 252), st.integers(0, 127), st.binary(max_size=40))
def test_a_reply_is_found_behind_any_noise_that_is_no_packet(
    form: PacketFormat, chain: type[ServoChain], noise: bytes, motor: int, error: int, data: bytes
) -> None:
    noise = noise.replace(b"\xff", b"")
    stream = bytearray(noise + chain.status(chain, motor, error, data))  # type: ignore[arg-type]
    reply = form.taken_reply(stream)
    assert reply is not None
    assert (reply.motor, reply.error, reply.data) == (motor, error, data)
    assert form.taken_reply(stream) is None


@both
@given(st.binary(max_size=400))
def test_garbage_is_no_reply_and_does_not_pile_up(form: PacketFormat, chain: type[ServoChain], garbage: bytes) -> None:
    stream = bytearray(garbage)
    while form.taken_reply(stream) is not None:
        pass
    assert len(stream) <= 128 + 7


@both
@given(st.binary(min_size=1, max_size=20), st.data())
def test_one_bit_wrong_is_no_reply(
    form: PacketFormat, chain: type[ServoChain], payload: bytes, data: st.DataObject
) -> None:
    packet = bytearray(chain.status(chain, 3, 0, payload))  # type: ignore[arg-type]
    bit = data.draw(st.integers(0, len(packet) * 8 - 1))
    packet[bit // 8] ^= 1 << bit % 8
    reply = form.taken_reply(packet)
    assert reply is None or (reply.motor, reply.data) != (3, payload)


@both
@given(st.binary(min_size=1, max_size=20))
def test_a_reply_that_arrives_byte_by_byte_is_whole_at_its_last(
    form: PacketFormat, chain: type[ServoChain], payload: bytes
) -> None:
    packet, stream = chain.status(chain, 7, 0, payload), bytearray()  # type: ignore[arg-type]
    found = []
    for byte in packet:
        stream.append(byte)
        found.append(form.taken_reply(stream))
    assert found[:-1] == [None] * (len(packet) - 1)
    assert found[-1] is not None


@both
@given(st.dictionaries(st.integers(0, 252), st.binary(min_size=4, max_size=4), min_size=1, max_size=6))
def test_a_sync_write_is_read_by_every_motor(
    form: PacketFormat, chain: type[ServoChain], data: dict[int, bytes]
) -> None:
    stream = bytearray(write_block(form, 42, data))
    ((to, code, params),) = chain.taken(chain, stream)  # type: ignore[arg-type]
    assert (to, code) == (0xFE, 0x83)
    assert all(bytes([motor]) + value in params for motor, value in data.items())


def test_an_echo_of_what_we_said_is_no_reply_of_a_dynamixel() -> None:
    assert DynamixelFormat().taken_reply(bytearray(DynamixelFormat().instruction(1, PING))) is None


@given(st.integers(-2047, 2047))
def test_a_signed_number_of_feetech_is_a_magnitude_and_a_sign(value: int) -> None:
    assert from_sign_bit(to_sign_bit(value, 11), 11) == value
    assert FEETECH.offset.value(FEETECH.offset.spelt(value)) == value


def test_each_register_of_a_dynamixel_is_read_from_its_place() -> None:
    """The manual of the X series: load 126, velocity 128, position 132, voltage 144, temperature 146."""
    parts = (-123, 2), (-17, 4), (-4097, 4), (111, 4), (222, 4), (119, 2), (41, 1)
    block = b"".join(value.to_bytes(size, "little", signed=True) for value, size in parts)
    seen = DYNAMIXEL.reading(ServoReply(1, 0x80, block))
    assert (seen.load_percent, seen.ticks, seen.voltage_v, seen.temperature_c) == (-12.3, -4097, 11.9, 41)
    assert seen.ticks_per_s == pytest.approx(-17 * 0.229 * 4096 / 60)
    assert seen.faults == ("alert",)
    assert DYNAMIXEL.reading(ServoReply(1, 0x7F, block)).faults == ()


def test_each_register_of_a_feetech_is_read_from_its_place() -> None:
    """The table of the STS series: position 56, speed 58, load 60, voltage 62, temperature 63; signs are bits."""
    block = b"".join(raw.to_bytes(2, "little") for raw in (0x8000 | 300, 0x8000 | 77, 0x0400 | 250)) + bytes((74, 38))
    seen = FEETECH.reading(ServoReply(1, 0x24, block))
    assert (seen.ticks, seen.ticks_per_s, seen.load_percent) == (-300, -77, -25.0)
    assert (seen.voltage_v, seen.temperature_c, seen.faults) == (7.4, 38, ("overheating", "overload"))


def test_faults_of_a_dynamixel_have_words() -> None:
    assert faults_of(0x24) == ("overheating", "overload")
