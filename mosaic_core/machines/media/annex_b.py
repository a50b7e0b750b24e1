"""H.264 as it travels: each unit behind a start code, and the parameter sets before every key frame (ITU-T H.264,
Annex B). Files hold the units behind their lengths and the parameter sets apart (ISO/IEC 14496-15).
"""

from __future__ import annotations

from collections.abc import Iterator

START_CODE = b"\x00\x00\x00\x01"
_SHORT_START_CODE = b"\x00\x00\x01"
_MOST_ZEROS = 16
_IDR, _SPS = 5, 7
_AVCC_VERSION = 1
"""First byte of a file's codec data; start codes begin with zeros."""
_AVCC_LENGTH_BYTES_AT, _AVCC_SETS_AT = 4, 5


class AnnexB:
    """Puts one H.264 stream into Annex B form. ``codec_data``: what its container tells of it beforehand (libav's
    ``extradata``), may be empty.

    Raises :class:`ValueError` for codec data that says it is that of a file and isn't.
    """

    def __init__(self, codec_data: bytes = b"") -> None:
        self._length_bytes = 0
        self._parameter_sets = codec_data
        if codec_data[:1] == bytes([_AVCC_VERSION]):
            self._length_bytes = 1 + (codec_data[_AVCC_LENGTH_BYTES_AT:_AVCC_SETS_AT] or b"\xff")[0] % 4
            self._parameter_sets = _joined(_sets_of(codec_data))

    @property
    def has_lengths(self) -> bool:
        """Its units stand behind their lengths."""
        return self._length_bytes > 0

    def of(self, data: bytes, *, is_key: bool) -> bytes:
        """One picture as it travels; ``data`` itself where that is so already."""
        if self._length_bytes and not has_start_code(data):
            data = _joined(_units_behind_lengths(data, self._length_bytes))
        if is_key and self._parameter_sets and not _holds(data, _SPS):
            return self._parameter_sets + data
        return data


def has_start_code(data: bytes) -> bool:
    """Whether it begins as Annex B has it, which allows zeros before the first start code."""
    head = data[:_MOST_ZEROS].lstrip(b"\x00")
    zeros = min(len(data), _MOST_ZEROS) - len(head)
    return head.startswith(b"\x01") and (zeros > 2 or (zeros == 2 and not _is_chain_of_lengths(data)))


def is_key_frame(data: bytes) -> bool:
    """Whether H.264 with start codes holds a picture that needs no other one."""
    return _holds(data, _IDR)


def _holds(data: bytes, kind: int) -> bool:
    start = data.find(_SHORT_START_CODE)
    while start >= 0 and start + 3 < len(data):
        if data[start + 3] & 0x1F == kind:
            return True
        start = data.find(_SHORT_START_CODE, start + 3)
    return False


def _joined(units: Iterator[bytes]) -> bytes:
    return b"".join(START_CODE + unit for unit in units)


def _units_behind_lengths(data: bytes, length_bytes: int) -> Iterator[bytes]:
    """A unit that is cut off is given as far as it goes: the decoder makes the best of it."""
    at = 0
    while at + length_bytes < len(data):
        begin = at + length_bytes
        at = begin + int.from_bytes(data[at:begin])
        if at > begin:
            yield data[begin:at]


def _is_chain_of_lengths(data: bytes) -> bool:
    """Whether ``data`` is units behind lengths of four bytes: one of 256 to 511 bytes looks like a start code."""
    at = 0
    while at + 4 < len(data):
        at += 4 + int.from_bytes(data[at : at + 4])
    return at == len(data)


def _sets_of(codec_data: bytes) -> Iterator[bytes]:
    """Sequence parameter sets, then picture parameter sets: a count, and each behind its length of two bytes."""
    at, counts = _AVCC_SETS_AT, (0x1F, 0xFF)
    for mask in counts:
        if at >= len(codec_data):
            raise ValueError("the codec data of the H.264 stream is cut off")
        count, at = codec_data[at] & mask, at + 1
        for _ in range(count):
            begin = at + 2
            at = begin + int.from_bytes(codec_data[at:begin])
            if at > len(codec_data):
                raise ValueError("the codec data of the H.264 stream is cut off")
            yield codec_data[begin:at]
