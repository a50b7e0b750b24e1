"""Reads what a key frame says about the pictures after it: enough to know when a file can't take them any more."""

from __future__ import annotations

from collections.abc import Iterator

from mosaic_core.contract.media_tap import TappedPicture

_START = b"\x00\x00\x01"
_SEQUENCE_SET = 7
_PARAMETER_SETS = (_SEQUENCE_SET, 8)
"""NAL unit types of sequence and picture parameter sets (H.264, table 7-1)."""
_VP8_SIZE = slice(6, 10)
"""Width and height in a VP8 key frame's header (RFC 6386, section 9.1)."""


def parameters_of(picture: TappedPicture) -> bytes:
    """Two key frames with equal ones need no closer look: the parameter sets of H.264, the size of VP8."""
    if picture.codec == "vp8":
        return picture.data[_VP8_SIZE]
    return b"".join(unit for unit in nal_units(picture.data) if unit[0] & 0x1F in _PARAMETER_SETS)


def profile_of(picture: TappedPicture) -> bytes:
    """Profile and constraints of H.264, which a file tells its player once; VP8 has none. Its other parameters may
    change within a file, and do when an encoder follows another rate: players read them before each key frame."""
    if picture.codec == "vp8":
        return b""
    return next((unit[1:3] for unit in nal_units(picture.data) if unit[0] & 0x1F == _SEQUENCE_SET), b"")


def nal_units(data: bytes) -> Iterator[bytes]:
    """The units of H.264 with start codes (Annex B), without these."""
    begin = data.find(_START)
    while begin >= 0:
        end = data.find(_START, begin + 3)
        unit = data[begin + 3 : end if end >= 0 else None]
        if end >= 0:
            unit = unit.rstrip(b"\x00")  # the first zero of a four-byte start code
        if unit:
            yield unit
        begin = end
