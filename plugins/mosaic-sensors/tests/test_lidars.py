"""Scanners on a serial line: their bytes become whole turns, wherever the stream is cut and whatever lies between."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import closing
from itertools import islice, pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.devices.pty_device import NAME, PtyDevice, plugged_in

from mosaic_core.testing import build, fake_host
from mosaic_core.words.errors import ConfigError, DeviceGone
from mosaic_sensors.laser_scan import Scan, decoded_scan
from mosaic_sensors.lidars import ld19, rplidar
from mosaic_sensors.lidars.connectors import Ld19, Ld19Configurer, LidarSender, Rplidar, RplidarConfigurer
from mosaic_sensors.lidars.fake_room import ld19_pieces, rplidar_pieces, wall_m
from mosaic_sensors.lidars.ld19 import Ld19Parser, crc8, encoded_packet
from mosaic_sensors.lidars.rplidar import RplidarParser, encoded_node, motor_command
from mosaic_sensors.lidars.turns import MAX_TURN_POINTS, Mounting, TurnParser

OF_THE_MANUAL = bytes.fromhex(
    "54 2C 68 08 AB 7E E0 00 E4 DC 00 E2 D9 00 E5 D5 00 E3 D3 00 E4 D0 00 E9 CD 00 E4 CA 00 E2 C7 00 E9 C5 00 E5"
    "C2 00 E5 C0 00 E5 BE 82 3A 1A 50"
)
"""The packet that LDROBOT's development manual of the LD19 takes apart."""
LD19_TURNS = b"".join(data for _, data in islice(ld19_pieces(), 4))
RPLIDAR_TURNS = b"".join(data for _, data in islice(rplidar_pieces(), 5))
PARSERS: list[tuple[type[TurnParser], bytes, int]] = [
    (Ld19Parser, LD19_TURNS, 450),
    (RplidarParser, RPLIDAR_TURNS, 360),
]
both_parsers = pytest.mark.parametrize(("kind", "turns", "points"), PARSERS)


def test_the_packet_of_the_manual_is_read_as_the_manual_reads_it() -> None:
    assert crc8(OF_THE_MANUAL[:-1]) == OF_THE_MANUAL[-1] == 0x50
    high, zero = (encoded_packet(start, start + 880, [(1000, 1)] * 12) for start in (35_000, 0))
    (turn,) = Ld19Parser().feed(high + zero + OF_THE_MANUAL + zero)
    assert len(turn) == 24
    manual = turn[12:]
    assert np.degrees(manual[[0, -1], 0]) == pytest.approx([324.27, 334.70])
    millimetres = [224, 220, 217, 213, 211, 208, 205, 202, 199, 197, 194, 192]
    confidences = [228, 226, 229, 227, 228, 233, 228, 226, 233, 229, 229, 229]
    assert manual[:, 1] * 1000 == pytest.approx(millimetres)
    assert manual[:, 2].tolist() == confidences


@pytest.mark.parametrize("place", range(46))
def test_the_packet_of_the_manual_with_one_bit_wrong_is_none(place: int) -> None:
    broken = bytearray(OF_THE_MANUAL)
    broken[place] ^= 1 << place % 8
    assert crc8(broken[:-1]) != 0x50


def test_a_measurement_is_read_as_the_interface_protocol_lays_it_out() -> None:
    begin = bytes([0x3E << 2 | 1, (90 * 64 << 1 | 1) & 0xFF, 90 * 64 >> 7, 4000 & 0xFF, 4000 >> 8])
    assert begin == encoded_node(90 * 64, 4000, 0x3E, begins=True)
    others, again = encoded_node(180 * 64, 8000, 1) * 9, begin + encoded_node(0, 0, 0) * 9
    (turn,) = RplidarParser().feed(rplidar.SCAN_BEGINS + begin + others + again)
    assert turn[:2].tolist() == [[math.pi / 2, 1.0, 0x3E], [math.pi, 2.0, 1]]


def test_a_measurement_is_read_as_a_driver_of_others_reads_it() -> None:
    """What the tests of the Ruby library `rplidar` 0.1 take apart: 6.484375°, 285.25 mm, quality 15, no beginning."""
    measured = bytes([62, 63, 3, 117, 4])
    begin = encoded_node(0, 400, 1, begins=True)
    (turn,) = RplidarParser().feed(rplidar.SCAN_BEGINS + begin + measured * 9 + begin + measured * 9)
    assert np.degrees(turn[1, 0]) == pytest.approx(6.484375)
    assert turn[1, 1:].tolist() == [0.28525, 15]


def test_the_words_of_the_scan_are_those_of_the_interface_protocol() -> None:
    """Slamtec, RPLIDAR Interface Protocol and Application Notes, rev. 1.1: STOP, SCAN and the answer's descriptor of
    five bytes, sent again and again, of the type 0x81."""
    assert (rplidar.STOP.hex(), rplidar.SCAN.hex()) == ("a525", "a520")
    begins = rplidar.SCAN_BEGINS
    described = int.from_bytes(begins[2:6], "little")
    assert (begins[:2].hex(), described & 0x3FFFFFFF, described >> 30, begins[6]) == ("a55a", 5, 1, 0x81)


def test_the_motor_is_set_as_the_makers_programs_set_it() -> None:
    assert motor_command(660).hex() == "a5f0029402c1"


@both_parsers
def test_a_turn_has_all_its_points_and_the_first_one_is_left_out(
    kind: type[TurnParser], turns: bytes, points: int
) -> None:
    parser = kind()
    found = parser.feed(turns)
    assert [len(turn) for turn in found] == [points] * len(found)
    assert len(found) in (2, 3)
    assert parser.bad_packets == 0
    assert found[0][:, 1] == pytest.approx([wall_m(angle) for angle in found[0][:, 0]], abs=0.001)


@both_parsers
@settings(max_examples=30)
@given(cuts=st.lists(st.integers(1, 6000), max_size=12))
def test_where_the_stream_is_cut_does_not_matter(
    kind: type[TurnParser], turns: bytes, points: int, cuts: list[int]
) -> None:
    edges = sorted({0, *cuts, len(turns)})
    parser = kind()
    found = [turn for start, end in pairwise(edges) for turn in parser.feed(turns[start:end])]
    whole = kind().feed(turns)
    assert len(found) == len(whole)
    assert all(np.array_equal(one, other) for one, other in zip(found, whole, strict=True))


@settings(max_examples=30)
@given(st.lists(st.binary(max_size=120).filter(lambda one: ld19.HEADER not in one), min_size=1, max_size=20))
def test_garbage_between_packets_costs_no_packet_of_an_ld19(garbage: list[bytes]) -> None:
    parser = Ld19Parser()
    packets = [LD19_TURNS[at : at + 47] for at in range(0, len(LD19_TURNS), 47)]
    stream = b"".join(garbage[at % len(garbage)] + packet for at, packet in enumerate(packets))
    found = parser.feed(stream)
    assert [len(turn) for turn in found] == [450, 450]


@settings(max_examples=30)
@given(st.binary(min_size=1, max_size=300))
def test_an_rplidar_is_understood_again_soon_after_garbage(garbage: bytes) -> None:
    parser = RplidarParser()
    parser.feed(RPLIDAR_TURNS[:2000] + garbage)
    found = parser.feed(RPLIDAR_TURNS)
    assert len(found[-1]) == 360
    assert found[-1][:, 1] == pytest.approx([wall_m(math.radians(angle)) for angle in range(360)], abs=0.001)


@given(st.lists(st.binary(max_size=300), max_size=20))
def test_no_bytes_make_a_parser_fail_or_grow(pieces: list[bytes]) -> None:
    for parser in (Ld19Parser(), RplidarParser()):
        for piece in pieces:
            for turn in parser.feed(piece):
                assert np.isfinite(turn).all()
        assert len(parser._rest) < 50


def test_a_turn_that_never_ends_costs_no_memory_and_is_left_out() -> None:
    parser = RplidarParser()
    begin, node = encoded_node(0, 400, 1, begins=True), encoded_node(64, 400, 1)
    assert parser.feed(begin + node * (2 * MAX_TURN_POINTS)) == []
    assert parser._turns._count <= MAX_TURN_POINTS
    assert parser.feed(begin + node * 9) == []
    assert [len(turn) for turn in parser.feed(begin + node * 9)] == [10]


# -- on the robot ------------------------------------------------------------------------------------------------


def turn_of(*points: tuple[float, float]) -> Any:
    return np.array([(math.radians(degrees), distance_m, 9.0) for degrees, distance_m in points])


def returns(scan: Scan) -> dict[int, float]:
    """Distance by whole degrees, counter-clockwise from straight ahead."""
    angles = np.degrees(scan.angle_min_rad + np.arange(len(scan)) * scan.angle_increment_rad)
    seen = ~np.isnan(scan.ranges_m)
    return {round(float(a)): round(float(r), 3) for a, r in zip(angles[seen], scan.ranges_m[seen], strict=True)}


def test_clockwise_angles_become_counter_clockwise_ones_and_the_nearest_point_of_a_ray_counts() -> None:
    scan = Mounting(360).scan(turn_of((0, 1), (90, 2), (90.2, 1.5), (270, 3), (45, 0)), "laser", 7.0, 0.1)
    assert returns(scan) == {0: 1, -90: 1.5, 90: 3}
    assert (scan.frame_id, scan.captured_at_s, scan.scan_time_s) == ("laser", 7.0, 0.1)


def test_a_mounted_scanner_is_turned_into_the_robots_directions() -> None:
    turn = turn_of((0, 1), (90, 2))
    assert returns(Mounting(360, yaw_rad=math.pi / 2).scan(turn, "", 0, 0)) == {90: 1, 0: 2}
    assert returns(Mounting(360, is_upside_down=True).scan(turn, "", 0, 0)) == {0: 1, 90: 2}
    assert returns(Mounting(360, range_min_m=1.5).scan(turn, "", 0, 0)) == {-90: 2}


def ld19_at(source: str, **params: Any) -> Ld19:
    return build(Ld19Configurer, params={"source": source, **params})


def rplidar_at(source: str, **params: Any) -> Rplidar:
    return build(RplidarConfigurer, params={"source": source, **params})


@pytest.mark.parametrize("make", [ld19_at, rplidar_at])
def test_the_fake_scanner_sees_the_walls_of_its_room_all_around(make: Any) -> None:
    lidar: LidarSender = make("fake")
    first, second = islice(iter(lidar.scans()), 2)
    for scan in (first, second):
        angles = scan.angle_min_rad + np.arange(len(scan)) * scan.angle_increment_rad
        assert scan.ranges_m == pytest.approx([wall_m(angle) for angle in angles], abs=0.05)
    assert second.scan_time_s == pytest.approx(0.1 if isinstance(lidar, Ld19) else 0.18)


@pytest.fixture
def device(monkeypatch: pytest.MonkeyPatch) -> Iterator[PtyDevice]:
    with plugged_in(monkeypatch) as found:
        yield found


def test_a_scan_is_sent_for_each_turn_that_a_scanner_says_over_its_line(device: PtyDevice) -> None:
    lidar = ld19_at(device.port, frame_id="laser")
    device.greeting = LD19_TURNS[30:3800]
    with closing(iter(lidar.scans())) as scans:
        scan = next(scans)
        lidar.send_scan(scan)
    assert device.bauds == [230_400]
    sent = decoded_scan(fake_host(lidar).sent[0].payload)
    assert (len(sent), sent.frame_id) == (450, "laser")


def test_an_rplidar_turns_only_while_it_is_read(device: PtyDevice) -> None:
    lidar = rplidar_at(device.port)
    device.greeting = rplidar.SCAN_BEGINS + RPLIDAR_TURNS[7:3700]
    with closing(iter(lidar.scans())) as scans:
        next(scans)
        assert device.heard() == b"\xa5\x25" + motor_command(660) + b"\xa5\x20"
    assert device.heard() == b"\xa5\x25" + motor_command(0)


@pytest.mark.parametrize(
    ("make", "turns", "broken", "losses"),
    [
        (ld19_at, LD19_TURNS, ld19.HEADER + bytes(45), {"refused": 3, "thinned": 5}),
        (rplidar_at, RPLIDAR_TURNS, bytes(10), {"refused": 1, "thinned": 6}),
    ],
)
def test_garbage_is_counted_and_what_comes_faster_than_it_is_read_is_thinned(
    make: Any, turns: bytes, broken: bytes, losses: dict[str, int]
) -> None:
    lidar = make("fake")
    lidar.fake_pieces = lambda: iter([(0.0, turns + broken * 3 + turns)])
    next(iter(lidar.scans()))
    assert fake_host(lidar).losses == losses


@pytest.mark.parametrize(
    ("make", "greeting", "rays"), [(ld19_at, LD19_TURNS[:3800], 450), (rplidar_at, RPLIDAR_TURNS[:3700], 360)]
)
def test_a_scanner_that_is_unplugged_for_thirty_seconds_is_gone_and_then_seen_again(
    make: Any, greeting: bytes, rays: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    lidar = make(NAME)
    with plugged_in(monkeypatch) as device, closing(iter(lidar.scans())) as scans:
        device.greeting = greeting
        next(scans)
        device.unplug()
        with pytest.raises(DeviceGone, match=NAME):
            next(scans)
    for _ in range(6):
        fake_host(lidar).clock.advance(5.0)
        with pytest.raises(DeviceGone, match=NAME):
            next(iter(lidar.scans()))
    with plugged_in(monkeypatch) as again, closing(iter(lidar.scans())) as scans:
        again.greeting = greeting
        assert len(next(scans)) == rays


def test_a_scanner_that_does_not_turn_is_told(device: PtyDevice, monkeypatch: pytest.MonkeyPatch) -> None:
    lidar = ld19_at(device.port)
    clock = fake_host(lidar).clock
    monkeypatch.setattr(fake_host(lidar), "monotonic_s", lambda: (clock.advance(1.0), clock.now_s)[1])
    with pytest.raises(DeviceGone, match="no turn for 5 s; does it turn, and is 230400 its baud rate"):
        next(iter(lidar.scans()))


@pytest.mark.parametrize("params", [{"source": "lidar.bin"}, {"rays": 1}, {"range_min_m": 20}])
def test_what_cannot_be_meant_is_refused_at_once(params: dict[str, Any]) -> None:
    with pytest.raises(ConfigError):
        ld19_at(params.pop("source", "fake"), **params)
