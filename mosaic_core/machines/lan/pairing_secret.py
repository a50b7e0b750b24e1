"""Reads what a person, or a program for them, gives to pair with a robot."""

from __future__ import annotations

import re

from mosaic_core.words.errors import AuthError

_IN_A_PAGE = "#pair="
_PIN = re.compile(r"[\d\s-]+", re.ASCII)


def pairing_secret(text: str) -> dict[str, str]:
    """``{"pin": …}`` or ``{"code": …}``: a PIN may have blanks or dashes; a code may come as the whole address
    that the QR code holds. Raises :class:`AuthError` for a number, which has lost the zeros it began with."""
    if not isinstance(text, str):
        cure = 'Write it in quotes: pin="012345".'
        message = f"the PIN is no text but a number, which has no zeros at its beginning. {cure}"
        raise AuthError(message, code="auth.pairing", cure=cure)
    stripped = text.strip()
    if _PIN.fullmatch(stripped):
        return {"pin": re.sub(r"\D", "", stripped)}
    return {"code": stripped.rpartition(_IN_A_PAGE)[2]}
