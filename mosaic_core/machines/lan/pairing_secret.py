"""Reads what a person, or a program for them, gives to pair with a robot."""

from __future__ import annotations

import re

_IN_A_PAGE = "#pair="
_PIN = re.compile(r"[\d\s-]+", re.ASCII)


def pairing_secret(text: str) -> dict[str, str]:
    """``{"pin": …}`` or ``{"code": …}``: a PIN may have blanks or dashes; a code may come as the whole address
    that the QR code holds."""
    stripped = text.strip()
    if _PIN.fullmatch(stripped):
        return {"pin": re.sub(r"\D", "", stripped)}
    return {"code": stripped.rpartition(_IN_A_PAGE)[2]}
