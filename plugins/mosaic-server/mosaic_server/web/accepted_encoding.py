"""Reads the header Accept-Encoding (RFC 9110, section 12.5.3)."""

from __future__ import annotations

import re


def accepts(header: str, encoding: str) -> bool:
    """Whether the header names the encoding, and not with ``q=0``, which forbids it."""
    for part in header.lower().split(","):
        name, *parameters = (word.strip() for word in part.split(";"))
        if name == encoding:
            return not any(re.fullmatch(r"q\s*=\s*0(\.0*)?", word) for word in parameters)
    return False
