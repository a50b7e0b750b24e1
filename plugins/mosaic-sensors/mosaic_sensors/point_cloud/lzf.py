"""LZF decompression, as PCL writes it into ``binary_compressed`` files (format: LibLZF by Marc Lehmann)."""

from __future__ import annotations


def lzf_decompressed(data: bytes, size_bytes: int) -> bytes:
    """The ``size_bytes`` in ``data``. Raises :class:`ValueError` if it holds more, less or nonsense."""
    out = bytearray()
    at, end = 0, len(data)
    try:
        while at < end:
            control = data[at]
            at += 1
            if control < 32:  # that many literals and one
                out += data[at : at + control + 1]
                at += control + 1
                continue
            length = control >> 5
            if length == 7:
                length += data[at]
                at += 1
            start = len(out) - ((control & 0x1F) << 8) - data[at] - 1
            at += 1
            _repeat(out, start, length + 2)
            if len(out) > size_bytes:
                break
    except IndexError:
        raise ValueError("its compressed data ends in the middle") from None
    if at > end or len(out) != size_bytes:
        raise ValueError(f"its compressed data gives {len(out)} bytes where {size_bytes} are announced")
    return bytes(out)


def _repeat(out: bytearray, start: int, length: int) -> None:
    if start < 0:
        raise ValueError("its compressed data points before its beginning")
    have = len(out) - start
    if have >= length:
        out += out[start : start + length]
    else:  # what is repeated overlaps what is written
        out += (out[start:] * (length // have + 1))[:length]
