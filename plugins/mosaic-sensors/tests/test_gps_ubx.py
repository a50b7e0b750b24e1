"""u-blox receivers: their frames become positions, whatever lies between, and nothing but corrections reaches them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import closing
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyubx2 import UBXReader
from support.devices.pty_device import NAME, PtyDevice, plugged_in

from mosaic_core.messages import GpsFix
from mosaic_core.testing import build, collect, fake_host, feed
from mosaic_core.words.errors import DeviceGone
from mosaic_sensors.ubx.connector import GpsUbx, GpsUbxConfigurer, RtcmCorrections
from mosaic_sensors.ubx.fake_receiver import encoded_solution
from mosaic_sensors.ubx.frames import SYNC, UbxFrames
from mosaic_sensors.ubx.rtcm import checked_frames, framed
from mosaic_sensors.ubx.solution import fix_of

ACK = bytes.fromhex("b5 62 05 01 02 00 06 01 0f 38")
"""ACK-ACK of a CFG-MSG."""
REFERENCE_POSITION = bytes.fromhex("d3 00 13 3e d0 00 03 8a 58 d9 49 3c 87 2f 34 10 9d 07 d6 af 48 20 5a d7 f7")
"""Message 1005 of a reference station, as open decoders publish it."""
NOW_US = 1_700_000_000_000_000
GGA = b"$GNGGA,120028.00,5200.0037,N,00417.9707,E,1,09,0.9,12.0,M,45.0,M,,*41\r\n"


def solved(**fields: Any) -> GpsFix:
    return fix_of(UBXReader.parse(encoded_solution(**fields)), NOW_US)


# -- the solution ------------------------------------------------------------------------------------------------


def test_a_solution_is_a_position_with_its_accuracy_in_our_units() -> None:
    fix = solved(
        year=2026, month=5, day=4, hour=12, min=0, second=28, nano=-250_000, validDate=1, validTime=1,
        lat=-33.8688197, lon=151.2092955, height=-1500, hAcc=14, gSpeed=1500, headMot=90.0, numSV=21,
    )  # fmt: skip
    assert fix.latitude == pytest.approx(-33.8688197, abs=1e-8)
    assert fix.longitude == pytest.approx(151.2092955, abs=1e-8)
    assert (fix.altitude, fix.accuracy_m, fix.speed_mps, fix.satellites) == (-1.5, 0.028, 1.5, 21)
    assert fix.course_rad == pytest.approx(math.pi / 2)
    assert fix.timestamp == 1777896028_000000 - 250


@pytest.mark.parametrize(
    ("fields", "word"),
    [
        ({}, "gps"),
        ({"fixType": 2}, "gps"),
        ({"fixType": 1}, "estimated"),
        ({"diffSoln": 1}, "dgps"),
        ({"diffSoln": 1, "carrSoln": 1}, "float-rtk"),
        ({"diffSoln": 1, "carrSoln": 2}, "rtk"),
        ({"gnssFixOk": 0}, "none"),
        ({"fixType": 0}, "none"),
        ({"fixType": 5}, "none"),
        ({"invalidLlh": 1}, "none"),
        ({"lat": 123.0}, "none"),
    ],
)
def test_the_kind_of_fix_is_a_word_and_without_one_the_place_is_unknown(fields: dict[str, Any], word: str) -> None:
    fix = solved(**fields)
    assert fix.fix == word
    assert (fix.latitude is None) == (fix.accuracy_m is None) == (word == "none")


def test_until_the_receiver_knows_the_time_it_is_that_of_this_computer() -> None:
    assert solved(year=2026, month=5, day=4, validDate=0, validTime=1).timestamp == NOW_US
    assert solved(year=2026, month=13, day=4, validDate=1, validTime=1).timestamp == NOW_US


# -- the stream --------------------------------------------------------------------------------------------------


@settings(max_examples=50)
@given(
    st.lists(st.binary(max_size=60).filter(lambda one: SYNC not in one), min_size=1, max_size=8),
    st.lists(st.integers(1, 1500), max_size=10),
)
def test_every_frame_is_found_between_garbage_wherever_the_stream_is_cut(garbage: list[bytes], cuts: list[int]) -> None:
    said = [ACK, encoded_solution(numSV=3), encoded_solution(numSV=4)] * 3
    stream = b"".join(garbage[at % len(garbage)] + frame + GGA for at, frame in enumerate(said))
    frames = UbxFrames()
    edges = sorted({0, *(cut for cut in cuts if cut < len(stream)), len(stream)})
    assert [one for start, end in pairwise(edges) for one in frames.feed(stream[start:end])] == said
    assert frames.bad_frames == 0


def test_a_broken_frame_is_counted_and_one_that_claims_too_much_is_not_waited_for() -> None:
    good, frames = encoded_solution(), UbxFrames()
    broken = bytes([*good[:20], good[20] ^ 1, *good[21:]])
    endless = SYNC + b"\x01\x07\xff\xff"
    assert list(frames.feed(broken + endless + good)) == [good]
    assert frames.bad_frames == 2


@given(st.lists(st.binary(max_size=200), max_size=20))
def test_no_bytes_make_it_fail_or_grow(pieces: list[bytes]) -> None:
    frames = UbxFrames()
    for piece in pieces:
        list(frames.feed(piece))
    assert len(frames._rest) < 6 + 4096 + 2


# -- corrections -------------------------------------------------------------------------------------------------


def test_frames_of_the_standard_pass_as_they_are() -> None:
    assert checked_frames(REFERENCE_POSITION * 2) == REFERENCE_POSITION * 2
    assert framed(REFERENCE_POSITION[3:-3]) == REFERENCE_POSITION


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "nothing"),
        (ACK, "byte 0 begins no"),
        (REFERENCE_POSITION + ACK, "byte 25 begins no"),
        (REFERENCE_POSITION[:-1], "cut off"),
        (REFERENCE_POSITION[:-1] + b"\x00", "checksum"),
        (b"\xd3", "cut off"),
        (b"\xd3\xff\xff", "begins no"),
    ],
)
def test_whatever_is_no_whole_frame_is_refused_with_the_cause(data: bytes, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        checked_frames(data)


@given(st.binary(max_size=100))
def test_no_bytes_pass_that_a_receiver_could_take_for_a_setting(data: bytes) -> None:
    with pytest.raises(ValueError, match="byte 25"):
        checked_frames(REFERENCE_POSITION + b"\xb5\x62" + data)


# -- on the robot ------------------------------------------------------------------------------------------------


@pytest.fixture
def device(monkeypatch: pytest.MonkeyPatch) -> Iterator[PtyDevice]:
    with plugged_in(monkeypatch) as found:
        yield found


def gps(source: str, **params: Any) -> GpsUbx:
    (made,) = build(GpsUbxConfigurer, params={"source": source, **params})
    assert isinstance(made, GpsUbx)
    return made


def with_corrections(source: str) -> tuple[GpsUbx, RtcmCorrections]:
    one, other = build(GpsUbxConfigurer, params={"source": source, "corrections": True})
    assert isinstance(one, GpsUbx)
    assert isinstance(other, RtcmCorrections)
    return one, other


def test_a_receiver_is_asked_for_solutions_and_each_becomes_a_position(device: PtyDevice) -> None:
    receiver = gps(device.port)
    device.greeting = GGA[9:] + encoded_solution(numSV=7) + GGA + ACK
    with closing(iter(receiver.messages())) as messages:
        assert next(messages).satellites == 7
        asked = list(UbxFrames().feed(device.heard()))
        assert [UBXReader.parse(one, msgmode=1).identity for one in asked] == ["CFG-MSG", "CFG-VALSET"]
        device.says(encoded_solution(numSV=8))
        assert next(messages).satellites == 8
    quiet = gps(device.port, ask=False)
    collect(quiet, 1)
    assert device.heard() == b""


def test_corrections_reach_the_receiver_and_settings_do_not(device: PtyDevice) -> None:
    receiver, corrections = with_corrections(device.port)
    device.greeting = encoded_solution()
    with closing(iter(receiver.messages())) as messages:
        next(messages)
        device.heard()
        fed = feed(corrections, [REFERENCE_POSITION, ACK, b"", REFERENCE_POSITION + ACK])
        assert device.heard() == REFERENCE_POSITION
    assert [one.code for one in fed.refused] == ["channel.invalid"] * 3
    assert [one.code for one in feed(corrections, [REFERENCE_POSITION]).refused] == ["plugin.no_device"]


def test_the_fake_receiver_becomes_exact_when_it_hears_corrections() -> None:
    receiver, corrections = with_corrections("fake")
    with closing(iter(receiver.messages())) as messages:
        assert next(messages).fix == "gps"
        feed(corrections, [REFERENCE_POSITION])
        exact = next(messages)
    assert (exact.fix, exact.accuracy_m) == ("rtk", 0.028)


def test_a_flood_of_solutions_is_read_to_its_end_and_nothing_of_it_is_kept(device: PtyDevice) -> None:
    receiver = gps(device.port)
    device.greeting = b"".join(encoded_solution(numSV=number) for number in range(40))
    with closing(iter(receiver.messages())) as messages:
        assert [next(messages).satellites for _ in range(40)] == list(range(40))
        device.says(encoded_solution(numSV=99))
        assert next(messages).satellites == 99
    assert fake_host(receiver).losses == {}


def test_broken_frames_and_payloads_that_are_too_short_are_counted(device: PtyDevice) -> None:
    receiver = gps(device.port)
    short = bytes.fromhex("b5 62 01 07 04 00 00 00 00 00 0c 4d")
    device.greeting = SYNC + b"\x01\x07\x00\x00\x00\x00" + short + encoded_solution()
    collect(receiver, 1)
    assert fake_host(receiver).losses == {"refused": 2}


def test_a_receiver_that_is_unplugged_for_thirty_seconds_is_gone_and_then_heard_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    receiver = gps(NAME)
    with plugged_in(monkeypatch) as device, closing(iter(receiver.messages())) as messages:
        device.greeting = encoded_solution()
        next(messages)
        device.unplug()
        with pytest.raises(DeviceGone, match=NAME):
            next(messages)
    for _ in range(6):
        fake_host(receiver).clock.advance(5.0)
        with pytest.raises(DeviceGone, match=NAME):
            next(iter(receiver.messages()))
    with plugged_in(monkeypatch) as again:
        again.greeting = encoded_solution(numSV=12)
        assert collect(receiver, 1)[0].satellites == 12


def test_a_receiver_that_says_no_solution_is_told(device: PtyDevice, monkeypatch: pytest.MonkeyPatch) -> None:
    receiver = gps(device.port)
    clock = fake_host(receiver).clock
    monkeypatch.setattr(fake_host(receiver), "monotonic_s", lambda: (clock.advance(1.0), clock.now_s)[1])
    with pytest.raises(DeviceGone, match="no solution for 10 s; is 38400 the right baud rate"):
        next(iter(receiver.messages()))
