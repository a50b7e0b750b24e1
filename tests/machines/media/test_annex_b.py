"""H.264 of files and streams: every unit behind a start code, the parameter sets before every key frame."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.media.annex_b import START_CODE, AnnexB, has_start_code, is_key_frame

SPS, PPS = b"\x67sequence", b"\x68picture"
SETS = START_CODE + SPS + START_CODE + PPS
# What libav never leaves in a unit: a start code, or a zero at its end, which would belong to the next one.
UNITS = st.binary(min_size=1, max_size=600).map(lambda body: b"\x41" + body.replace(b"\x00", b"\x03"))


def behind_length(unit: bytes, length_bytes: int = 4) -> bytes:
    return len(unit).to_bytes(length_bytes) + unit


def of_file(length_bytes: int = 4) -> bytes:
    """Codec data of an MP4: version, profile, length of lengths, one SPS, one PPS."""
    head = bytes([1, 100, 0, 31, 0xFC | (length_bytes - 1)])
    return head + b"\xe1" + behind_length(SPS, 2) + b"\x01" + behind_length(PPS, 2)


@pytest.mark.parametrize("length_bytes", [1, 2, 4])
@given(units=st.lists(UNITS.map(lambda unit: unit[:200]), min_size=1, max_size=4))
def test_units_behind_lengths_stand_behind_start_codes(length_bytes: int, units: list[bytes]) -> None:
    data = b"".join(behind_length(unit, length_bytes) for unit in units)
    expected = b"".join(START_CODE + unit for unit in units)
    assert AnnexB(of_file(length_bytes)).of(data, is_key=False) == expected
    assert AnnexB(of_file(length_bytes)).of(data, is_key=True) == SETS + expected


@given(unit=UNITS)
def test_the_first_unit_of_any_length_tells_files_from_streams(unit: bytes) -> None:
    assert not has_start_code(behind_length(unit))
    assert has_start_code(START_CODE + unit)
    assert has_start_code(START_CODE[1:] + unit)
    assert has_start_code(b"\x00\x00" + START_CODE + unit)


@pytest.mark.parametrize("data", [b"", b"\x00", b"\x00" * 40, b"\xff\xd8\xff\xe0", b"\x50\x14\x00\x9d\x01\x2a"])
def test_pictures_of_other_kinds_have_no_start_code(data: bytes) -> None:
    assert not has_start_code(data)


def test_what_has_start_codes_stays_as_it_is() -> None:
    data = START_CODE + b"\x41abc"
    for codec_data in (b"", SETS, of_file()):
        assert AnnexB(codec_data).of(data, is_key=False) is data
    assert AnnexB().of(data, is_key=True) is data


def test_a_key_frame_gets_the_parameter_sets_that_it_lacks_and_no_others() -> None:
    key = START_CODE + b"\x65idr"
    for codec_data in (SETS, of_file()):
        assert AnnexB(codec_data).of(key, is_key=True) == SETS + key
        assert AnnexB(codec_data).of(SETS + key, is_key=True) == SETS + key


def test_a_picture_that_is_cut_off_is_given_as_far_as_it_goes() -> None:
    assert AnnexB(of_file()).of(behind_length(b"\x41abcdef")[:-3], is_key=False) == START_CODE + b"\x41abc"
    assert AnnexB(of_file()).of(b"\x00\x00", is_key=False) == b""


@pytest.mark.parametrize("length", range(1, len(of_file())))
def test_codec_data_that_is_cut_off_is_told(length: int) -> None:
    with pytest.raises(ValueError, match="cut off"):
        AnnexB(of_file()[:length])


@given(codec_data=st.binary(max_size=60), data=st.binary(max_size=60), is_key=st.booleans())
def test_nonsense_is_refused_at_the_beginning_or_not_at_all(codec_data: bytes, data: bytes, is_key: bool) -> None:
    try:
        units = AnnexB(codec_data)
    except ValueError:
        return
    units.of(data, is_key=is_key)


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (SETS + b"\x00\x00\x01\x65c", True),
        (START_CODE + b"\x41abc", False),
        (b"\x00\x00\x01", False),
        (b"", False),
    ],
)
def test_a_key_frame_is_an_idr_picture(data: bytes, expected: bool) -> None:
    assert is_key_frame(data) is expected
