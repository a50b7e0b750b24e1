"""NMEA sentences become positions, whatever their order, and garbage becomes nothing."""

from __future__ import annotations

import math
from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_sensors.nmea import NmeaPosition, PositionTracker, parsed


def sentence(body: str) -> bytes:
    checksum = 0
    for character in body.encode():
        checksum ^= character
    return f"${body}*{checksum:02X}\r\n".encode()


def fed(*bodies: str) -> list[NmeaPosition]:
    tracker = PositionTracker()
    found = [tracker.feed(parsed(sentence(body))) for body in bodies]
    assert tracker.bad_lines == 0
    return [position for position in found if position is not None]


GGA = "GPGGA,092750.000,5321.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,"
RMC = "GNRMC,092750.000,A,5321.6802,N,00630.3372,W,36.0,90.0,280511,,,A"
GSA = "GNGSA,A,3,10,07,05,02,29,04,08,13,,,,,1.72,1.03,1.38"
NO_FIX_GGA = "GPGGA,,,,,,0,,,,,,,,"
NO_FIX_RMC = "GPRMC,,V,,,,,,,,,,N"


def test_a_gga_is_a_position_in_degrees_and_metres() -> None:
    (position,) = fed(GGA)

    assert position.fix == "gps"
    assert position.latitude_deg == pytest.approx(53.36133667)
    assert position.longitude_deg == pytest.approx(-6.50562)
    assert (position.altitude_m, position.satellites, position.hdop) == (61.7, 8, 1.03)
    assert position.time_utc is None


def test_an_rmc_adds_speed_course_and_date() -> None:
    (position,) = fed(GSA, RMC, GGA)

    assert position.speed_mps == pytest.approx(18.52)
    assert position.course_rad == pytest.approx(math.pi / 2)
    assert position.vdop == 1.38
    assert position.time_utc == datetime(2011, 5, 28, 9, 27, 50, tzinfo=UTC)


def test_an_epoch_makes_one_position_in_either_order() -> None:
    assert len(fed(GGA, RMC, GGA, RMC, GGA, RMC)) == 3
    assert len(fed(RMC, GGA, RMC, GGA, RMC, GGA)) == 3


def test_where_no_gga_comes_the_rmc_is_the_position() -> None:
    positions = fed(RMC, RMC, RMC)

    assert len(positions) == 2
    assert positions[0].fix == "gps"
    assert positions[0].latitude_deg == pytest.approx(53.36133667)
    assert positions[0].altitude_m is None


@pytest.mark.parametrize("bodies", [(NO_FIX_GGA,), (RMC, NO_FIX_GGA), (NO_FIX_RMC, NO_FIX_RMC)])
def test_without_a_fix_there_is_no_place_and_no_speed(bodies: tuple[str, ...]) -> None:
    position = fed(*bodies)[-1]

    assert position.fix == "none"
    assert (position.latitude_deg, position.longitude_deg, position.speed_mps) == (None, None, None)


@pytest.mark.parametrize(("quality", "fix"), [(2, "dgps"), (4, "rtk"), (5, "float-rtk"), (8, "simulated")])
def test_the_quality_is_told_in_words(quality: int, fix: str) -> None:
    assert fed(GGA.replace(",W,1,", f",W,{quality},"))[0].fix == fix


def test_the_southern_and_eastern_hemispheres_have_their_signs() -> None:
    (position,) = fed("GPGGA,000000,3352.000,S,15112.000,E,1,4,1.0,5.0,M,0.0,M,,")

    assert position.latitude_deg == pytest.approx(-33.866667, abs=1e-6)
    assert position.longitude_deg == pytest.approx(151.2)


def test_a_gga_just_after_midnight_is_not_a_day_early() -> None:
    before = RMC.replace("092750.000", "235959.000")
    after = GGA.replace("092750.000", "000000.000")

    assert fed(before, after)[0].time_utc == datetime(2011, 5, 29, 0, 0, 0, tzinfo=UTC)


@pytest.mark.parametrize(
    "line",
    [
        b"",
        b"\xff\xfe\x00",
        b"79,M,55.2,M,,*6D\r\n",
        sentence(GGA).replace(b"61.7", b"61.8"),
        sentence(GGA)[:30],
        sentence("GPGGA,092750.000,9921.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,"),
        sentence("GPGGA,092750.000,,,,,1,8,1.03,61.7,M,55.2,M,,"),
        sentence("GPGGA,092750.000,53x1.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,"),
    ],
)
def test_garbage_and_impossible_places_are_counted_and_skipped(line: bytes) -> None:
    tracker = PositionTracker()

    assert tracker.feed(parsed(line)) is None
    assert tracker.bad_lines == 1
    assert tracker.feed(parsed(sentence(GGA))) is not None


def test_sentences_of_other_kinds_are_neither_positions_nor_errors() -> None:
    assert fed("GPGSV,1,1,01,10,63,137,17", "GPXYZ,1,2") == []


def test_an_infinite_dilution_is_left_out() -> None:
    (position,) = fed(GGA.replace("1.03", "inf"))

    assert position.hdop is None


@given(st.lists(st.one_of(
    st.binary(max_size=100),
    st.builds(
        lambda kind, rest: sentence(f"GP{kind},{rest}"),
        st.sampled_from(["GGA", "RMC", "GSA"]),
        st.text("0123456789.,NSEWAVMx-", max_size=80),
    ),
), max_size=20))  # fmt: skip
def test_no_line_raises_and_every_position_is_on_earth(lines: list[bytes]) -> None:
    tracker = PositionTracker()
    for line in lines:
        position = tracker.feed(parsed(line))
        if position is not None and position.fix != "none":
            assert position.latitude_deg is not None
            assert abs(position.latitude_deg) <= 90
