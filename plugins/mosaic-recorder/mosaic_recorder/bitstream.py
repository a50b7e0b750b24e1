"""What a key frame says about the pictures after it: enough to know when a file can't take them any more."""

from __future__ import annotations

from collections.abc import Iterator

from mosaic_core.contract.media_tap import TappedPicture

_START = b"\x00\x00\x01"
_PARAMETER_SETS = (7, 8)
"""NAL unit types of sequence and picture parameter sets (H.264, table 7-1)."""
_VP8_SIZE = slice(6, 10)
"""Width and height in a VP8 key frame's header (RFC 6386, section 9.1)."""


def format_of(picture: TappedPicture) -> bytes:
    """Equal for two key frames that may share a file: the parameter sets of H.264, the size of VP8."""
    if picture.codec == "vp8":
        return picture.data[_VP8_SIZE]
    return b"".join(unit for unit in nal_units(picture.data) if unit[0] & 0x1F in _PARAMETER_SETS)


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
