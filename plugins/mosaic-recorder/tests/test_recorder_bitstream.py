"""What a key frame says about the pictures after it."""

from __future__ import annotations

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.contract.media_tap import TappedPicture
from mosaic_recorder.bitstream import nal_units, parameters_of, profile_of

UNITS = st.lists(
    st.binary(min_size=1, max_size=20).map(lambda body: b"\x67" + body.replace(b"\x00", b"\x01") + b"\x80"), max_size=8
)


@given(UNITS, st.lists(st.sampled_from([b"\x00\x00\x01", b"\x00\x00\x00\x01"]), min_size=8, max_size=8))
def test_units_are_found_after_either_start_code(units: list[bytes], starts: list[bytes]) -> None:
    stream = b"".join(start + unit for start, unit in zip(starts, units, strict=False))
    assert list(nal_units(stream)) == units


@given(st.binary(max_size=200))
def test_no_bytes_raise(data: bytes) -> None:
    assert all(unit for unit in nal_units(data))
    for codec in ("h264", "vp8"):
        picture = TappedPicture(data, 0.0, True, codec)  # type: ignore[arg-type]
        assert len(parameters_of(picture)) <= len(data)
        assert len(profile_of(picture)) <= 2


def test_key_frames_of_one_encoder_share_a_file(studio: Any) -> None:
    for codec in ("h264", "vp8"):
        keys = [one for one in studio.encoded(40, codec, key_every=10) if one.is_key]
        assert len(keys) == 4
        assert len({parameters_of(key) for key in keys}) == 1
        assert parameters_of(keys[0])


def test_another_size_needs_another_file(studio: Any) -> None:
    for codec in ("h264", "vp8"):
        small, large = (studio.encoded(1, codec, size)[0] for size in ((320, 240), (640, 480)))
        assert parameters_of(small) != parameters_of(large)


def test_the_profile_is_that_of_the_sequence_parameter_set(studio: Any) -> None:
    assert profile_of(TappedPicture(b"\x00\x00\x01\x67\x42\xe0\x1f\x80", 0.0, True, "h264")) == b"\x42\xe0"
    assert profile_of(studio.encoded(1, "vp8")[0]) == b""
